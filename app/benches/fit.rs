//! One whole fit of the demo's photo (192 x 192 pixels), processes and files included.
//!
//! `cargo bench -p lookalike-app --bench fit`. CPU seconds, memory and other photos: `experiments/speed.py`.

use criterion::{Criterion, criterion_group, criterion_main};
use std::{path::Path, process::Command};

fn run(folder: &Path, line: &str) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike"));
    let output = command.current_dir(folder).args(line.split_whitespace()).output().expect("the program starts");
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
}

fn bench(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    run(folder.path(), "demo -o demo --progress none");
    let mut group = criterion.benchmark_group("whole");
    group.sample_size(10);
    for workers in [1, 2] {
        let line = format!(
            "fit demo/photo.exr --env demo/environment.exr --out out --force --workers {workers} --progress none"
        );
        group.bench_function(format!("fit of 192 x 192 pixels, workers {workers}"), |b| {
            b.iter(|| run(folder.path(), &line));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);

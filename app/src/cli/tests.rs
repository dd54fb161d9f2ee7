//! Precedence, settings files and presets: argument lists in, settings or messages out.

use super::{args::Command, parse};
use crate::settings::{CompareSettings, DisplayExposure, FitSettings, Workers};
use clap::CommandFactory;
use lookalike::{
    fit::{Compress, Gammas, Methods, SearchKind, Start},
    metric::MetricKind,
    render::subset::SampleCount,
    scene::Camera,
};
use lookalike_coordinator::policy::{Policy, Speculation};
use std::{ffi::OsString, fs, path::PathBuf, time::Duration};

/// A folder that goes away with the test, holding one settings file.
struct Settings {
    folder: PathBuf,
}

impl Settings {
    fn new(name: &str, toml: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("lookalike-cli-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("fit.toml"), toml).unwrap();
        Self { folder }
    }

    fn file(&self) -> String {
        self.folder.join("fit.toml").to_str().unwrap().into()
    }
}

impl Drop for Settings {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn command(arguments: &[&str]) -> anyhow::Result<Command> {
    let argv = ["lookalike"].iter().chain(arguments).map(OsString::from).collect();
    Ok(parse(argv)?.command)
}

fn fit(arguments: &[&str]) -> anyhow::Result<FitSettings> {
    match command(arguments)? {
        Command::Fit(args) => args.into_settings(),
        other => panic!("parsed as {other:?}"),
    }
}

fn compare(arguments: &[&str]) -> anyhow::Result<CompareSettings> {
    match command(arguments)? {
        Command::Compare(args) => Ok(args.into_settings()),
        other => panic!("parsed as {other:?}"),
    }
}

fn message<T: std::fmt::Debug>(result: anyhow::Result<T>) -> String {
    format!("{:#}", result.unwrap_err())
}

const PLAIN: [&str; 6] = ["fit", "ball.exr", "--env", "garden.hdr", "--out", "run"];

#[test]
fn the_grammar_is_consistent() {
    super::args::Cli::command().debug_assert();
}

#[test]
fn a_plain_fit_has_the_defaults_of_the_design() {
    let settings = fit(&PLAIN).unwrap();
    assert_eq!(settings.capture.photo, PathBuf::from("ball.exr"));
    assert_eq!(settings.capture.environment.path, PathBuf::from("garden.hdr"));
    assert_eq!((settings.capture.environment.mapping, settings.capture.environment.rotation_deg), (None, 0.0));
    assert_eq!(settings.capture.view.camera, Camera::Orthographic);
    assert_eq!(settings.display_exposure, DisplayExposure::Auto);
    let (methods, default) = (settings.methods, Methods::default());
    assert_eq!(format!("{methods:?}"), format!("{default:?}"), "command line and library have one default");
    let method = methods.common().clone();
    assert_eq!((method.gammas, method.samples), (Gammas::DEFAULT.values(), SampleCount::Draws(256)));
    assert_eq!((method.search, method.polish, method.seed), (SearchKind::LeastSquares, true, 0));
    assert_eq!((method.start, method.compress), (Start::Scan, Compress::Tangent));
    assert_eq!(settings.cluster.workers, Workers::PerCore);
    assert_eq!(settings.cluster.policy.wait_for_workers, Duration::from_secs(600));
    assert_eq!(settings.cluster.policy.grace, Duration::from_secs(60));
    assert_eq!((settings.cluster.listen, settings.cluster.access), (None, None));
}

#[test]
fn every_group_of_flags_reaches_the_settings() {
    let flags = "--mask m.png --layer beauty --env-mapping angular --env-rotation -30 --camera perspective:30 --sphere -5,6.5,100 \
                 --model cook-torrance --fix ks=.5,f0=.1 --bounds m=.1:.3 --gammas 1:2:0.5 --samples full --sampling uniform --subsets 4 --search pattern \
                 --polish off --judge object --display-exposure from:old.json --seed 7 --max-cssim 0.1 --workers 0 \
                 --listen 10.0.0.1:4100 --advertise node7:4101 --wait-for-workers 90s --grace 1h \
                 --progress json";
    let settings = fit(&[&PLAIN[..], &flags.split_whitespace().collect::<Vec<_>>()].concat()).unwrap();
    assert_eq!(settings.capture.mask, Some("m.png".into()));
    assert_eq!(settings.capture.layer.as_deref(), Some("beauty"));
    assert_eq!(settings.capture.environment.rotation_deg, -30.0);
    assert_eq!(settings.capture.sphere.unwrap().x, -5.0);
    assert_eq!(settings.methods.common().gammas, [1.0, 1.5, 2.0]);
    assert_eq!((settings.methods.common().samples, settings.methods.common().subsets), (SampleCount::Full, 4));
    let method = settings.methods.common();
    let (lower, upper) = method.ranges.bounds(method.model);
    assert_eq!((&lower[3..], &upper[3..]), (&[0.5, 0.5, 0.5, 0.1, 0.1][..], &[0.5, 0.5, 0.5, 0.1, 0.3][..]));
    assert_eq!((settings.methods.common().search, settings.methods.common().polish), (SearchKind::Pattern, false));
    assert_eq!(settings.display_exposure, DisplayExposure::From("old.json".into()));
    assert_eq!((settings.max_cssim, settings.methods.common().seed), (Some(0.1), 7));
    assert_eq!(settings.cluster.workers, Workers::Count(0));
    assert_eq!(settings.cluster.advertise.unwrap().to_string(), "node7:4101");
    assert_eq!(settings.cluster.policy.grace, Duration::from_secs(3600));
    assert_eq!(settings.cluster.listen, Some(([10, 0, 0, 1], 4100).into()));
    // The access file says under which name workers reach the coordinator, so no other name is needed.
    let flags = ["--listen", "0.0.0.0:4100", "--access", "cluster.json"];
    assert_eq!(fit(&[&PLAIN[..], &flags].concat()).unwrap().cluster.access, Some("cluster.json".into()));
}

#[test]
fn models_are_those_of_auto_or_those_named() {
    let models = |flags: &[&str]| {
        let methods = fit(&[&PLAIN[..], flags].concat()).unwrap().methods;
        methods.iter().map(|method| methods.label(method)).collect::<Vec<_>>()
    };
    assert_eq!(models(&[]), ["ggx, f90 = 1", "ggx", "ggx-haze"]);
    assert_eq!(models(&["--model", "ggx"]), ["ggx"]);
    assert_eq!(models(&["--model", "ward,ggx", "--fix", "kd=0"]), ["ward", "ggx"]);
    assert_eq!(models(&["--model=auto", "--fix", "f90=.9"]), ["ggx", "ggx-haze"]);
    let refused = |flags: &[&str]| message(fit(&[&PLAIN[..], flags].concat()));
    assert!(refused(&["--model", "auto,ward"]).contains("auto stands alone"));
    assert!(refused(&["--model", "ggx,phong"]).contains("invalid value 'phong'"));
    assert!(refused(&["--model", "ward,ggx", "--fix", "f90=1"]).contains("model ward has no parameter 'f90'"));
}

#[test]
fn settings_file_equals_flags() {
    let file = Settings::new(
        "same",
        "photo = 'ball.exr'\nenv = '/maps/garden.hdr'\nenv_rotation = -30\nout = 'run'\nsphere = [128, 127.5, 100]\n\
         polish = false\nmax-cssim = 0.1\ndisplay-exposure = 'from:old.json'\ngammas = 2.2\nlog = 'info'\nresume = false\n",
    );
    let settings = fit(&["fit", &file.file()]).unwrap();
    assert_eq!(settings.capture.photo, file.folder.join("ball.exr"), "relative paths are relative to the file");
    assert_eq!(settings.out, file.folder.join("run"));
    assert_eq!(settings.capture.environment.path, PathBuf::from("/maps/garden.hdr"));
    assert_eq!(settings.capture.environment.rotation_deg, -30.0);
    assert_eq!(settings.capture.sphere.unwrap().to_string(), "128,127.5,100");
    assert_eq!(settings.display_exposure, DisplayExposure::From(file.folder.join("old.json")));
    assert_eq!((settings.methods.common().polish, settings.max_cssim), (false, Some(0.1)));
    assert_eq!(settings.methods.common().gammas, [2.2]);
}

#[test]
fn flags_and_positional_arguments_win_over_the_file() {
    let file = Settings::new("wins", "photo = 'ball.exr'\nenv = 'garden.hdr'\nout = 'run'\nseed = 1\n");
    let settings = fit(&["fit", "--seed", "3", &file.file(), "other.exr", "--env=attic.hdr"]).unwrap();
    assert_eq!((settings.capture.photo, settings.methods.common().seed), ("other.exr".into(), 3));
    assert_eq!((settings.capture.environment.path, settings.out), ("attic.hdr".into(), file.folder.join("run")));
}

#[test]
fn positional_arguments_fill_up_from_the_file() {
    let file = Settings::new("fill", "reference = 'a.exr'\nimage = 'b.exr'\nmetric = 'icid'\n");
    let both = compare(&["compare", &file.file()]).unwrap();
    assert_eq!((both.reference, both.image), (file.folder.join("a.exr"), file.folder.join("b.exr")));
    assert_eq!(both.metric, MetricKind::Icid);
    let one = compare(&["compare", "c.exr", &file.file()]).unwrap();
    assert_eq!((one.reference, one.image), ("c.exr".into(), file.folder.join("b.exr")));
    let gap = Settings::new("gap", "image = 'b.exr'\n");
    assert!(message(compare(&["compare", &gap.file()])).contains("the positional argument before"));
}

#[test]
fn mistakes_in_a_settings_file_are_reported_with_line_and_key() {
    let head = "photo = 'ball.exr'\nenv = 'garden.hdr'\nout = 'run'\n";
    for (line, phrase) in [
        ("gama = '1:3:0.1'", "unknown key \"gama\"; the nearest one is \"gammas\""),
        ("wait-for-worker = '1s'", "the nearest one is \"wait-for-workers\""),
        ("help = true", "unknown key \"help\""),
        ("env_mapping = 'round'", "invalid value 'round' for '--env-mapping <MAPPING>' [possible values: latlong"),
        ("gammas = '3:1:0.1'", "for '--gammas <A:B:STEP>': the last gamma must lie between"),
        ("seed = 1979-05-27", "\"seed\": expected text, a number"),
        ("resume = 'yes'", "\"resume\" must be true or false"),
        ("seed = ", "expected literal string"),
    ] {
        let file = Settings::new("wrong", &format!("{head}{line}\n"));
        let message = message(fit(&["fit", &file.file()]));
        assert!(message.contains(&format!("{}:4: ", file.file())) && message.contains(phrase), "{line}: {message}");
    }
    let twice = Settings::new("twice", &format!("{head}max-cssim = 1\nmax_cssim = 2\n"));
    assert!(message(fit(&["fit", &twice.file()])).contains("fit.toml:5: \"max-cssim\" is given twice"));
}

#[test]
fn settings_files_are_read_once_and_must_exist() {
    assert!(message(fit(&["fit", "nowhere.toml"])).contains("cannot read the settings file nowhere.toml"));
    assert!(message(fit(&["fit", "a.toml", "b.toml"])).contains("two settings files"));
    // The value of a flag is not a settings file, whatever its name.
    let settings = fit(&["fit", "ball.exr", "--env", "garden.hdr", "-o", "odd.toml"]).unwrap();
    assert_eq!(settings.out, PathBuf::from("odd.toml"));
}

#[test]
fn the_paper_is_a_bundle_that_explicit_flags_override() {
    let settings = fit(&[&PLAIN[..], &["--preset", "paper"]].concat()).unwrap().methods.common().clone();
    assert_eq!((settings.model.name(), settings.samples), ("cook-torrance", SampleCount::default()));
    assert_eq!((settings.search, settings.polish), (SearchKind::Pattern, false));
    assert_eq!(settings.gammas.len(), 21);
    assert_eq!((settings.start, settings.compress), (Start::Paper, Compress::Clamp));

    let settings = fit(&[&PLAIN[..], &["--model", "ggx", "--preset", "paper", "--polish=on"]].concat()).unwrap();
    let settings = settings.methods.common().clone();
    assert_eq!((settings.model.name(), settings.polish), ("ggx", true));
    assert_eq!((settings.search, settings.start), (SearchKind::Pattern, Start::Paper));

    let file =
        Settings::new("preset", "photo = 'b.exr'\nenv = 'g.hdr'\nout = 'r'\npreset = 'paper'\nsamples = 'full'\n");
    let settings = fit(&["fit", &file.file(), "--polish", "on"]).unwrap().methods.common().clone();
    assert_eq!((settings.model.name(), settings.samples, settings.polish), ("cook-torrance", SampleCount::Full, true));
}

#[test]
fn flags_that_contradict_each_other_are_refused() {
    for (flags, phrase) in [
        (&["--sphere", "1,2,3", "--normals", "n.exr"][..], "give one of them"),
        (&["--workers", "0", "--listen", "0.0.0.0:4100"], "--advertise HOST"),
    ] {
        let message = message(fit(&[&PLAIN[..], flags].concat()));
        assert!(message.contains(phrase), "{flags:?}: {message}");
    }
}

#[test]
fn a_rendering_needs_exactly_one_material() {
    let render = |flags: &str| match command(&flags.split(' ').collect::<Vec<_>>()).unwrap() {
        Command::Render(args) => args.into_settings(),
        other => panic!("parsed as {other:?}"),
    };
    assert!(render("render --env g.hdr -o a.exr --model ggx --params kd=.5,f0=.04,alpha=.1").is_ok());
    assert!(render("render --env g.hdr -o a.exr --brdf gold.binary").is_ok());
    for (flags, phrase) in [
        ("-o a.exr", "no material"),
        ("-o a.exr --model ggx", "--model needs --params"),
        ("-o a.exr --params kd=1", "--params needs --model"),
        ("-o a.exr --brdf gold.binary --model ggx", "two materials"),
    ] {
        let message = message(render(&format!("render --env g.hdr {flags}")));
        assert!(message.contains(phrase), "{flags}: {message}");
    }
}

#[test]
fn policy_is_the_same_from_flags_file_and_defaults() {
    assert_eq!(fit(&PLAIN).unwrap().cluster.policy, Policy::default());
    let flags = [
        "--heartbeat=200ms",
        "--lost-after=2s",
        "--spare-leases=0",
        "--suspect-after=1",
        "--node-crashes=7",
        "--speculate=3.5",
        "--speculate-after=9s",
        "--verify-fraction=0.25",
        "--drain-time=4min",
    ];
    let policy = fit(&[&PLAIN[..], &flags].concat()).unwrap().cluster.policy;
    let expected = Policy {
        heartbeat: Duration::from_millis(200),
        lost_after: Duration::from_secs(2),
        spare_leases: 0,
        suspect_after: 1,
        node_crashes: 7,
        speculation: Speculation { factor: Some(3.5), after: Duration::from_secs(9) },
        verify_fraction: 0.25,
        drain_time: Duration::from_mins(4),
        ..Policy::default()
    };
    assert_eq!(policy, expected);
    let toml =
        "photo = \"b.exr\"\nenv = \"g.hdr\"\nout = \"run\"\nspeculate = false\nverify-fraction = 1\nnode_crashes = 2\n";
    let file = Settings::new("policy", toml);
    let policy = fit(&["fit", &file.file()]).unwrap().cluster.policy;
    assert_eq!((policy.speculation.factor, policy.verify_fraction, policy.node_crashes), (None, 1.0, 2));
}

#[test]
fn invalid_policy_is_refused_by_name() {
    for (flag, expected) in [
        ("--heartbeat=4s", "--lost-after: expected at least two heartbeats, 8s, found 5s"),
        ("--verify-fraction=1.5", "--verify-fraction: expected a number from 0 to 1, found 1.5"),
        ("--verify-fraction=-1", "from 0 to 1, found -1"),
        ("--speculate=0.5", "a factor of at least 1, found 0.5"),
        ("--speculate=maybe", "expected on, off, or a factor"),
        ("--node-crashes=0", "--node-crashes: expected 1 or more"),
        ("--lost-after=soon", "--lost-after"),
    ] {
        let error = message(fit(&[&PLAIN[..], &[flag]].concat()));
        assert!(error.contains(expected), "{flag}: {error}");
    }
}

//! The command line as scripts use it: the real program, exact exit codes, and the contents of stdout and stderr.

use lookalike::{choice::Choice as _, metric::MetricKind};
use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

struct Answer {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

fn lookalike_in(folder: &Path, arguments: &[&str]) -> Answer {
    let Output { status, stdout, stderr } = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .output()
        .expect("the binary under test starts");
    let text = |bytes| String::from_utf8(bytes).expect("output is UTF-8");
    Answer { code: status.code(), stdout: text(stdout), stderr: text(stderr) }
}

fn lookalike(arguments: &str) -> Answer {
    lookalike_in(Path::new("."), &arguments.split_whitespace().collect::<Vec<_>>())
}

/// Asserts that the arguments are refused with code 2, nothing on stdout and each phrase on stderr.
#[track_caller]
fn refused(answer: &Answer, phrases: &[&str]) {
    assert_eq!(answer.code, Some(2), "{}", answer.stderr);
    assert_eq!(answer.stdout, "");
    assert!(answer.stderr.starts_with("error: ") && !answer.stderr.contains('\x1b'), "{}", answer.stderr);
    for phrase in phrases {
        assert!(answer.stderr.contains(phrase), "expected {phrase:?} in: {}", answer.stderr);
    }
}

#[test]
fn help_and_version_go_to_stdout() {
    for command in ["", "demo", "fit", "batch", "status", "render", "compare", "study"] {
        let answer = lookalike(&format!("{command} --help"));
        assert_eq!((answer.code, answer.stderr.as_str()), (Some(0), ""), "{command}");
        assert!(answer.stdout.contains("Usage: lookalike"), "{command}");
    }
    for command in ["worker --help", "access new --help", "help fit"] {
        assert_eq!(lookalike(command).code, Some(0), "{command}");
    }
    let version = lookalike("--version");
    assert_eq!(version.code, Some(0));
    assert!(version.stdout.starts_with("lookalike 0.") && version.stdout.contains("\nconventions: right-handed world"));
}

#[test]
fn without_arguments_the_short_help_is_an_error() {
    let answer = lookalike("");
    assert_eq!((answer.code, answer.stdout.as_str()), (Some(2), ""));
    assert!(answer.stderr.contains("Usage: lookalike") && answer.stderr.contains("compare"));
}

#[test]
fn every_default_of_a_fit_is_in_its_help() {
    let help = lookalike("fit -h").stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    for default in [
        "[default: auto]",
        "[default: 1:3:0.1]",
        "[default: 256]",
        "[default: importance]",
        "[default: least-squares]",
        "[default: on]",
        "[default: orthographic]",
        "[default: 127.0.0.1:0]",
        "[default: 10min]",
        "[default: 60s]",
    ] {
        assert!(help.contains(default), "{default}");
    }
    for heading in ["Input:", "Geometry:", "Method:", "Output:", "Workers:", "Diagnostics:"] {
        assert!(help.contains(heading), "{heading}");
    }
}

#[test]
fn bad_usage_is_code_two_and_lists_what_is_possible() {
    let fit = "fit ball.exr --env garden.hdr --out run";
    let metrics =
        format!("[possible values: {}]", MetricKind::TABLE.iter().map(|row| row.1).collect::<Vec<_>>().join(", "));
    for (arguments, phrases) in [
        ("fitt".to_owned(), &["unrecognized subcommand 'fitt'", "'fit'"][..]),
        ("fit ball.exr".into(), &["required arguments", "--env <MAP>", "--out <DIR>"]),
        (format!("{fit} --sampel 3"), &["unexpected argument '--sampel'", "'--samples'"]),
        (
            format!("{fit} --model phong"),
            &["'phong'", "--model", "possible values: auto, ggx, ggx-haze, cook-torrance"],
        ),
        (format!("{fit} --model ggx-f90"), &["the model 'ggx-f90' is now ggx, which has the parameter f90"]),
        (format!("{fit} --fix f9=1"), &["--fix f9", "it has kd, f0, f90, alpha"]),
        (format!("{fit} --bounds alpha=.1"), &["--bounds", "expected NAME=LOWER:UPPER"]),
        (format!("{fit} --search simplex"), &["'simplex'", "[possible values: least-squares, pattern]"]),
        (format!("{fit} --polish maybe"), &["'maybe'", "[possible values: on, off]"]),
        (format!("{fit} --gammas 3:1:0.1"), &["--gammas", "the last gamma must lie between"]),
        (format!("{fit} --samples 0"), &["--samples", "whole number above 0, or full"]),
        (format!("{fit} --sphere 1,2"), &["--sphere", "CX,CY,R"]),
        (format!("{fit} --camera perspective:200"), &["--camera", "between 0.1 and 170 degrees"]),
        (format!("{fit} --grace soon"), &["--grace", "expected number"]),
        (format!("{fit} --listen localhost"), &["--listen", "invalid socket address"]),
        (
            format!("{fit} --access a.json --advertise node7"),
            &["'--access <FILE>' cannot be used with '--advertise <A>'"],
        ),
        ("access new -o a.json".into(), &["--address <HOST:PORT>"]),
        ("access new --address node7 -o a.json".into(), &["'node7'", "expected HOST:PORT with a port"]),
        ("access new --address node7:0 -o a.json".into(), &["expected HOST:PORT with a port from 1"]),
        ("access new --address fe80::1 -o a.json".into(), &["an IPv6 address needs brackets"]),
        (format!("{fit} --max-cssim -1"), &["--max-cssim"]),
        (format!("{fit} --env-rotation east"), &["--env-rotation", "a finite number"]),
        (format!("{fit} --log lookalike=loud"), &["--log"]),
        ("compare a.exr".into(), &["required arguments", "<IMAGE>"]),
        ("compare a.exr b.exr --metric no-such-metric".into(), &["'no-such-metric'", &metrics]),
        ("render --env g.hdr -o a.exr".into(), &["no material"]),
        ("render --env g.hdr -o a.exr --model ggx --params alpha=x".into(), &["alpha must be a number"]),
        ("worker".into(), &["--access <FILE>"]),
        ("study no-such-study.toml --out study".into(), &["cannot read the study no-such-study.toml"]),
        ("demo --workers 0".into(), &["--workers 1 or more"]),
    ] {
        refused(&lookalike(&arguments), phrases);
    }
}

#[test]
fn commands_and_flags_that_do_not_exist_are_refused_with_the_usage() {
    let fit = "fit ball.exr --env garden.hdr --out run";
    for (arguments, phrases) in [
        (
            "no-such-command run".to_owned(),
            &["unrecognized subcommand 'no-such-command'", "Usage: lookalike", "try '--help'"][..],
        ),
        (format!("{fit} --exposure-gain rgb"), &["unexpected argument '--exposure-gain'", "'--help'"]),
    ] {
        refused(&lookalike(&arguments), phrases);
    }
}

#[test]
fn access_file_is_created_once_with_its_key_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let new = ["access", "new", "--address", "node7:4100", "-o", "cluster.json"];
    let answer = lookalike_in(folder.path(), &new);
    assert_eq!((answer.code, answer.stdout.as_str()), (Some(0), ""), "{}", answer.stderr);
    assert_eq!(answer.stderr.lines().count(), 1);
    let [json, pem] = ["cluster.json", "cluster.key.pem"].map(|name| folder.path().join(name));
    let text = fs::read_to_string(&json).unwrap();
    assert_eq!(lookalike::protocol::Access::parse(&text).unwrap().address, "node7:4100");
    assert!(fs::read_to_string(&pem).unwrap().contains("BEGIN CERTIFICATE"));
    #[cfg(unix)]
    for file in [&json, &pem] {
        use std::os::unix::fs::PermissionsExt;
        assert_eq!(fs::metadata(file).unwrap().permissions().mode() & 0o777, 0o600);
    }
    refused(&lookalike_in(folder.path(), &new), &["cluster.json is already there", "choose another name"]);
    assert_eq!(fs::read_to_string(&json).unwrap(), text);
    let nowhere = ["access", "new", "--address", "node7:4100", "-o", "no/such/folder.json"];
    refused(&lookalike_in(folder.path(), &nowhere), &["cannot write no/such/folder"]);
}

#[test]
fn error_in_a_settings_file_names_the_line() {
    let folder = tempfile::tempdir().unwrap();
    let toml = "photo = \"ball.exr\"\nenv = \"garden.hdr\"\n\n# a typing error\nsampels = 3\n";
    fs::write(folder.path().join("fit.toml"), toml).unwrap();
    let answer = lookalike_in(folder.path(), &["fit", "fit.toml", "--out", "run"]);
    refused(&answer, &["error: fit.toml:5: unknown key \"sampels\"; the nearest one is \"samples\""]);
    refused(&lookalike_in(folder.path(), &["fit", "other.toml"]), &["cannot read the settings file other.toml"]);
}

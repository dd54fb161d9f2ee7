//! The files for Kubernetes use existing flags and are consistent with each other. `.ci/run` checks them against the API where a
//! validator is installed.

use super::source;
use serde_json::Value;
use std::{collections::BTreeSet, fs, process::Command};

/// All objects of the folder, except kustomize's own file.
fn objects() -> Vec<Value> {
    let [kustomization] = &documents("kustomization.yaml")[..] else { panic!("one document") };
    let files: Vec<&str> = list(&kustomization["resources"]).iter().map(|name| name.as_str().unwrap()).collect();
    let entries = fs::read_dir(source("deploy/kubernetes")).unwrap();
    let mut there: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    // The pod for copying files is applied by hand.
    there.retain(|name| !["copy.yaml", "kustomization.yaml"].contains(&name.as_str()));
    let (named, there) = (files.iter().copied().collect::<BTreeSet<_>>(), there.iter().map(String::as_str).collect());
    assert_eq!(named, there, "the files that kustomization.yaml names");
    files.into_iter().flat_map(documents).collect()
}

fn documents(file: &str) -> Vec<Value> {
    let text = fs::read_to_string(source("deploy/kubernetes").join(file)).unwrap();
    serde_saphyr::from_multiple(&text).unwrap_or_else(|error| panic!("{file}: {error}"))
}

fn object(kind: &str, name: &str) -> Value {
    let found = objects().into_iter().find(|object| object["kind"] == kind && object["metadata"]["name"] == name);
    found.unwrap_or_else(|| panic!("no {kind} {name}"))
}

/// The pod of a Job.
fn pod(job: &str) -> Value {
    object("Job", job)["spec"]["template"].clone()
}

/// The only container of a pod.
fn container(pod: &Value) -> Value {
    let [container] = list(&pod["spec"]["containers"]) else { panic!("one container") };
    container.clone()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("not a list: {value}"))
}

fn arguments(container: &Value) -> Vec<String> {
    list(&container["args"])
        .iter()
        .map(|argument| argument.as_str().expect("text, in quotes if need be").into())
        .collect()
}

/// The value of a flag, `--flag=value`.
fn value_of(arguments: &[String], flag: &str) -> String {
    let found = arguments.iter().find_map(|argument| argument.strip_prefix(flag)?.strip_prefix('='));
    found.unwrap_or_else(|| panic!("{flag} in {arguments:?}")).to_owned()
}

fn help(command: &str) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test")).args([command, "--help"]).output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

const JOBS: [&str; 2] = ["lookalike-coordinator", "lookalike-workers"];

#[test]
fn containers_use_existing_flags() {
    for job in JOBS {
        let arguments = arguments(&container(&pod(job)));
        let help = help(&arguments[0]);
        let flags: Vec<&str> = arguments
            .iter()
            .filter(|word| word.starts_with("--"))
            .map(|word| word.split('=').next().unwrap())
            .collect();
        assert!(flags.len() >= 2, "{arguments:?}");
        for flag in flags {
            let known = help.split_whitespace().any(|word| word.trim_end_matches(',') == flag);
            assert!(known, "{job}: lookalike {} has no {flag}", arguments[0]);
        }
    }
}

#[test]
fn workers_reach_the_coordinator_through_the_service_and_the_network_policies() {
    let (coordinator, workers) = (pod(JOBS[0]), pod(JOBS[1]));
    let port = |name: &str| {
        let container = container(&coordinator);
        list(&container["ports"]).iter().find(|port| port["name"] == name).unwrap()["containerPort"].as_u64().unwrap()
    };
    let arguments = arguments(&container(&coordinator));
    assert_eq!(value_of(&arguments, "--listen"), format!("0.0.0.0:{}", port("workers")));
    assert_eq!(value_of(&arguments, "--metrics"), format!("0.0.0.0:{}", port("metrics")));
    let service = object("Service", "lookalike-coordinator");
    assert_eq!(service["spec"]["ports"][0]["port"], port("workers"));
    assert_eq!(service["spec"]["selector"], coordinator["metadata"]["labels"]);
    let admits = object("NetworkPolicy", "lookalike-coordinator");
    let lets_out = object("NetworkPolicy", "lookalike-worker");
    assert_eq!(admits["spec"]["podSelector"]["matchLabels"], coordinator["metadata"]["labels"]);
    assert_eq!(lets_out["spec"]["podSelector"]["matchLabels"], workers["metadata"]["labels"]);
    let ways = [
        (&admits["spec"]["ingress"][0], "from", &workers, "workers"),
        (&lets_out["spec"]["egress"][0], "to", &coordinator, "workers"),
    ];
    for (rule, end, other, port) in ways {
        assert_eq!(rule[end][0]["podSelector"]["matchLabels"], other["metadata"]["labels"]);
        assert_eq!(rule["ports"][0]["port"], port);
    }
    // The documented address of the access file.
    let document = fs::read_to_string(source("docs/cluster.md")).unwrap();
    assert!(document.contains(&format!("--address lookalike-coordinator:{}", port("workers"))));
}

#[test]
fn workers_get_the_access_file_and_never_the_key() {
    for (job, keys) in [(JOBS[0], None), (JOBS[1], Some(vec!["access.json".to_owned()]))] {
        let pod = pod(job);
        let mut volumes = list(&pod["spec"]["volumes"]).iter();
        let secret = &volumes.find(|volume| volume["name"] == "access").unwrap()["secret"];
        assert_eq!(secret["secretName"], "lookalike-access");
        let key = |item: &Value| item["key"].as_str().unwrap().to_owned();
        let items: Option<Vec<String>> = secret.get("items").map(|items| list(items).iter().map(key).collect());
        assert_eq!(items, keys, "{job}");
        let container = container(&pod);
        let mut mounts = list(&container["volumeMounts"]).iter();
        let mount = mounts.find(|mount| mount["name"] == "access").unwrap();
        let path = format!("{}/access.json", mount["mountPath"].as_str().unwrap());
        assert_eq!(value_of(&arguments(&container), "--access"), path);
    }
}

#[test]
fn pods_run_without_privileges_as_the_user_of_the_image() {
    let image = fs::read_to_string(source("deploy/Containerfile")).unwrap();
    let user: u64 = image.lines().find_map(|line| line.strip_prefix("USER ")?.split(':').next()?.parse().ok()).unwrap();
    for job in JOBS {
        let pod = pod(job);
        let container = container(&pod);
        let context = &pod["spec"]["securityContext"];
        assert_eq!((&context["runAsNonRoot"], &context["runAsUser"]), (&true.into(), &user.into()), "{job}");
        assert_eq!(context["seccompProfile"]["type"], "RuntimeDefault", "{job}");
        assert_eq!(pod["spec"]["automountServiceAccountToken"], false, "{job}");
        let context = &container["securityContext"];
        assert_eq!(context["readOnlyRootFilesystem"], true, "{job}");
        assert_eq!(context["allowPrivilegeEscalation"], false, "{job}");
        assert_eq!(context["capabilities"]["drop"][0], "ALL", "{job}");
        let resources = &container["resources"];
        assert!(resources["requests"]["memory"].is_string() && resources["limits"]["memory"].is_string(), "{job}");
    }
}

#[test]
fn exit_codes_that_a_retry_cannot_change_fail_the_job_at_once() {
    let spec = object("Job", JOBS[0])["spec"].clone();
    let rules = list(&spec["podFailurePolicy"]["rules"]);
    let final_codes = rules.iter().find(|rule| rule["action"] == "FailJob").unwrap()["onExitCodes"]["values"].clone();
    // Exit codes of `lookalike --help`; 3, 130 and deaths by a signal are retried.
    assert_eq!(final_codes, serde_json::json!([1, 2, 4]));
    assert!(arguments(&container(&pod(JOBS[0]))).contains(&"--resume".to_owned()));
}

#[test]
fn jobs_end_after_their_own_failures_but_not_after_node_disruptions() {
    for job in JOBS {
        let spec = object("Job", job)["spec"].clone();
        let rules = list(&spec["podFailurePolicy"]["rules"]);
        let ignored = rules.iter().find(|rule| rule["action"] == "Ignore").unwrap();
        assert_eq!(ignored["onPodConditions"][0]["type"], "DisruptionTarget", "{job}");
        // The API requires this of a Job with such a policy.
        assert_eq!(
            (&spec["podReplacementPolicy"], &spec["template"]["spec"]["restartPolicy"]),
            (&"Failed".into(), &"Never".into()),
            "{job}"
        );
        // Each worker tries to reach a missing coordinator for 30 minutes.
        assert!(spec["backoffLimit"].as_u64().unwrap() <= 20, "{job}");
    }
    let document = fs::read_to_string(source("docs/cluster.md")).unwrap();
    assert!(document.contains("Delete both Jobs after a failure"));
}

#[test]
fn liveness_probe_uses_the_port_of_the_metrics() {
    let probe = container(&pod(JOBS[0]))["livenessProbe"]["httpGet"].clone();
    assert_eq!(probe, serde_json::json!({ "path": "/healthz", "port": "metrics" }));
}

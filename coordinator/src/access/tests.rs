use std::fs;
use std::time::Duration;

use super::*;

fn new() -> Credentials {
    Credentials::new("h:1".into(), SystemTime::now()).unwrap()
}

fn read(path: &Path) -> Result<Credentials, CredentialsError> {
    Credentials::read(path, SystemTime::now())
}

#[test]
fn both_files_are_private_and_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("access.json");
    let credentials = new();
    credentials.write(&path).unwrap();
    let again = read(&path).unwrap();
    assert_eq!(again.access, credentials.access);
    assert_eq!(again.identity.pin(), credentials.identity.pin());
    for file in [&path, &folder.path().join("access.key.pem")] {
        assert!(!private_file::is_readable_by_others(&File::open(file).unwrap()));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn workers_copy_has_no_key_and_debug_shows_neither_secret() {
    let credentials = new();
    let (json, pem) = (credentials.access.to_json(), credentials.identity.to_pem());
    let key: String = pem.split("PRIVATE KEY-----").nth(1).unwrap().lines().collect();
    assert!(key.len() > 60 && !json.contains(&key[..20]));
    let secret = json.split('"').nth(11).unwrap();
    let debug = format!("{credentials:?}");
    assert!(secret.len() == 64 && !debug.contains(secret) && !debug.contains(&key[..20]), "{debug}");
}

#[test]
fn two_runs_have_two_secrets() {
    assert_ne!(new().access.secret, new().access.secret);
}

#[test]
fn new_access_file_overwrites_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cluster.json");
    new().create(&path).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert!(matches!(new().create(&path), Err(CredentialsError::Exists { .. })));
    fs::remove_file(&path).unwrap();
    // An existing key file is not overwritten either, as it may belong to another access file.
    let error = new().create(&path).unwrap_err();
    assert!(error.to_string().contains("cluster.key.pem is already there"), "{error}");
    fs::write(&path, text).unwrap();
    assert!(read(&path).is_ok());
}

#[test]
fn mismatched_and_invalid_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("access.json");
    let key = key_path(&path);
    assert!(matches!(read(&path), Err(CredentialsError::ReadAccess { .. })));
    new().write(&path).unwrap();
    fs::write(&key, new().identity.to_pem()).unwrap();
    assert!(matches!(read(&path), Err(CredentialsError::Mismatch { .. })));
    fs::write(&key, "no pem").unwrap();
    assert!(matches!(read(&path), Err(CredentialsError::Key { .. })));
    fs::remove_file(&key).unwrap();
    let error = read(&path).unwrap_err();
    assert!(error.to_string().contains("lookalike access new"), "{error}");
    assert_eq!(error.exit_code(), 2);
    fs::write(&path, "{}").unwrap();
    assert!(matches!(read(&path), Err(CredentialsError::Access { .. })));
}

#[test]
fn expired_certificate_is_refused_before_workers_refuse_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("access.json");
    new().write(&path).unwrap();
    let in_three_years = SystemTime::now() + Duration::from_hours(3 * 365 * 24);
    let error = Credentials::read(&path, in_three_years).unwrap_err();
    assert!(matches!(error, CredentialsError::Certificate { source: TlsError::ExpiredCertificate, .. }), "{error}");
}

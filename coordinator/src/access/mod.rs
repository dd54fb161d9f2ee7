//! Permission to join a run: the access file, which workers get, and the key file, which they do not.
//!
//! ```text
//!   access.json      address, hash of the certificate, secret: what a worker needs to join
//!   access.key.pem   certificate and private key: what a coordinator needs to admit these workers
//! ```
//! There are two files because the first one is copied to every worker: with the key in it, any of those machines could
//! impersonate the coordinator. They lie side by side, so that a coordinator finds both when it uses an access file made
//! beforehand or resumes a run; a Kubernetes Secret holds them under two keys and mounts only the first one in workers.

mod identity;
mod private_file;

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use lookalike::protocol::{Access, AccessError, Secret};
use lookalike_worker::tls::TlsError;
use thiserror::Error;
use tracing::warn;

use crate::atomic;

pub use self::identity::Identity;

/// The content of both files, which a coordinator needs to admit workers.
#[derive(Debug)]
pub struct Credentials {
    /// The part that workers get.
    pub access: Access,
    /// The part that only the coordinator has.
    pub identity: Identity,
}

/// The access file or its key file cannot be used or made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CredentialsError {
    /// The system provides no random bytes.
    #[error("the system provides no random bytes for a secret and a key: {0}")]
    Randomness(String),
    /// A file cannot be written.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file exists, and a cluster may be using it.
    #[error("{} is already there and may be in use; choose another name, or remove it first", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The access file cannot be read.
    #[error("cannot read the access file {}", path.display())]
    ReadAccess {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The key file cannot be read.
    #[error(
        "cannot read the coordinator's key {}; `lookalike access new` creates it together with the access file, and both must be in one folder",
        path.display()
    )]
    ReadKey {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file is not an access file.
    #[error("the access file {} is not usable", path.display())]
    Access {
        /// The file.
        path: PathBuf,
        /// The fault.
        source: AccessError,
    },
    /// The file is not a key file.
    #[error("the coordinator's key {} is not usable: {fault}", path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// The fault.
        fault: String,
    },
    /// The key file belongs to another access file.
    #[error(
        "the access file {} names a certificate other than the one in {}; use two files from the same `lookalike access new`",
        access.display(), key.display()
    )]
    Mismatch {
        /// The access file.
        access: PathBuf,
        /// The key file.
        key: PathBuf,
    },
    /// Workers would reject the certificate.
    #[error("the certificate in {} is not usable", path.display())]
    Certificate {
        /// The key file.
        path: PathBuf,
        /// Why.
        source: TlsError,
    },
}

impl CredentialsError {
    /// The exit code of the program: 2 for bad input, 3 when the system fails.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Self::Randomness(_)) { 3 } else { 2 }
    }
}

/// The key file that belongs to an access file: `access.key.pem` beside `access.json`.
#[must_use]
pub fn key_path(access: &Path) -> PathBuf {
    access.with_extension("key.pem")
}

impl Credentials {
    /// New credentials, for workers that reach the coordinator at `address` (`HOST:PORT`), valid from about `now` on.
    ///
    /// # Errors
    /// When the system provides no random bytes.
    pub fn new(address: String, now: SystemTime) -> Result<Self, CredentialsError> {
        let mut secret = [0; 32];
        getrandom::fill(&mut secret).map_err(|error| CredentialsError::Randomness(error.to_string()))?;
        let identity = Identity::new(now).map_err(|error| CredentialsError::Randomness(error.to_string()))?;
        let access = Access { address, certificate: identity.pin(), secret: Secret::from_bytes(secret) };
        Ok(Self { access, identity })
    }

    /// Read an access file and the key file beside it.
    ///
    /// # Errors
    /// When one of them is missing or unusable, they do not belong together, or the certificate is not valid at `now`.
    pub fn read(path: &Path, now: SystemTime) -> Result<Self, CredentialsError> {
        let read_error = |source| CredentialsError::ReadAccess { path: path.to_owned(), source };
        let text = read_private(path).map_err(read_error)?;
        let access =
            Access::parse(&text).map_err(|source| CredentialsError::Access { path: path.to_owned(), source })?;
        let key = key_path(path);
        let pem = read_private(&key).map_err(|source| CredentialsError::ReadKey { path: key.clone(), source })?;
        let identity = Identity::from_pem(&pem)
            .map_err(|fault| CredentialsError::Key { path: key.clone(), fault: fault.to_owned() })?;
        if access.certificate != identity.pin() {
            return Err(CredentialsError::Mismatch { access: path.to_owned(), key });
        }
        identity
            .check(now)
            .map_err(|fault| CredentialsError::Certificate { path: key, source: TlsError::of_certificate(&fault) })?;
        Ok(Self { access, identity })
    }

    /// Write both files with mode 0600, replacing existing ones. The access file is written last, so that it never exists without
    /// its key.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), CredentialsError> {
        self.write_with(path, atomic::write_private)
    }

    /// Write both files with mode 0600, and replace none.
    ///
    /// # Errors
    /// When one of them exists or cannot be written.
    pub fn create(&self, path: &Path) -> Result<(), CredentialsError> {
        let exists = |path: PathBuf| CredentialsError::Exists { path };
        if path.exists() {
            return Err(exists(path.to_owned()));
        }
        self.write_with(path, private_file::create).map_err(|error| match error {
            CredentialsError::Write { path, source } if source.kind() == io::ErrorKind::AlreadyExists => exists(path),
            error => error,
        })
    }

    fn write_with(&self, path: &Path, write: impl Fn(&Path, &[u8]) -> io::Result<()>) -> Result<(), CredentialsError> {
        let put = |path: &Path, content: &str| {
            write(path, content.as_bytes()).map_err(|source| CredentialsError::Write { path: path.to_owned(), source })
        };
        let key = key_path(path);
        put(&key, self.identity.to_pem())?;
        // Remove a key without an access file, which would prevent the next attempt.
        put(path, self.access.to_json().as_str()).inspect_err(|_| drop(std::fs::remove_file(&key)))
    }
}

/// Read a file that should be private, and warn if it is not.
fn read_private(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    if private_file::is_readable_by_others(&file) {
        warn!(path = %path.display(), "other users may read this secret file; restrict it with chmod 600");
    }
    let mut text = String::new();
    file.read_to_string(&mut text)?;
    Ok(text)
}

#[cfg(test)]
mod tests;

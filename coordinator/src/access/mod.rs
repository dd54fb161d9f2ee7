//! Who may join a run: the access file, which workers get, and the key file, which they do not.
//!
//! ```text
//!   access.json      address, hash of the certificate, secret: what a worker needs to join
//!   access.key.pem   certificate and private key: what makes a process the coordinator of the access file
//! ```
//! Two files, because the first one is copied to every worker: with the key in it, each of those machines could stand in for
//! the coordinator. They lie beside each other, so that a coordinator that takes an access file made beforehand, or a run that
//! is taken up again, finds both; a Kubernetes Secret holds them under two keys and mounts only the first one in workers.

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

/// What a coordinator needs to let workers in: what both files hold.
#[derive(Debug)]
pub struct Credentials {
    /// What workers get to know.
    pub access: Access,
    /// What they do not.
    pub identity: Identity,
}

/// No access file, or no key file to it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CredentialsError {
    /// The system gives no random bytes.
    #[error("the system gives no random bytes for a secret and a key: {0}")]
    Randomness(String),
    /// A file cannot be written.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// There is such a file, which a cluster may be using.
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
        /// What the system says.
        source: io::Error,
    },
    /// The key file cannot be read.
    #[error(
        "cannot read the coordinator's key {}; it is made together with the access file by `lookalike access new` and has to lie beside it",
        path.display()
    )]
    ReadKey {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The access file is none.
    #[error("the access file {} is not usable", path.display())]
    Access {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: AccessError,
    },
    /// The key file is none.
    #[error("the coordinator's key {} is not usable: {fault}", path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// The two files do not belong together.
    #[error(
        "the access file {} names another certificate than {} holds; take both from one `lookalike access new`",
        access.display(), key.display()
    )]
    Mismatch {
        /// The access file.
        access: PathBuf,
        /// The key file.
        key: PathBuf,
    },
    /// No worker would accept the certificate.
    #[error("the certificate in {} is not usable", path.display())]
    Certificate {
        /// The key file.
        path: PathBuf,
        /// Why.
        source: TlsError,
    },
}

impl CredentialsError {
    /// The exit code of the program: 2 for bad input, 3 when the system fails us.
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
    /// New ones, for workers that reach the coordinator at `address` (`HOST:PORT`), valid from about `now` on.
    ///
    /// # Errors
    /// When the system gives no random bytes.
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

    /// Write both files, mode 0600, in the place of what was there; the access file last, so that whoever sees it can use it.
    ///
    /// # Errors
    /// When the system does not let us.
    pub fn write(&self, path: &Path) -> Result<(), CredentialsError> {
        self.write_with(path, atomic::write_private)
    }

    /// Write both files, mode 0600, where none were.
    ///
    /// # Errors
    /// When one is there, or the system does not let us.
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
        // A key without its access file would only be in the way.
        put(path, self.access.to_json().as_str()).inspect_err(|_| drop(std::fs::remove_file(&key)))
    }
}

/// Read a file that should be private, and say so if it is not.
fn read_private(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    if private_file::is_readable_by_others(&file) {
        warn!(path = %path.display(), "others may read this secret file; chmod 600 would prevent it");
    }
    let mut text = String::new();
    file.read_to_string(&mut text)?;
    Ok(text)
}

#[cfg(test)]
mod tests;

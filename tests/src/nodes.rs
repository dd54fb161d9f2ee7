//! Node types of the cluster suite: small; their outputs are pure functions; some of them abort their process.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;

use lookalike::graph::{Blob, BlobHash, NodeFailure, NodeType, Registry, RunContext};
use lookalike::nodes;

/// All of them.
#[must_use]
pub fn registry() -> Registry {
    Registry::default().with(Digest).with(Grow).with(Fail).with(Panic).with(Abort).with(Gate)
}

/// The node types of fits, of which one kind returns outputs with one wrong bit.
#[must_use]
pub fn false_registry(kind: &str) -> Registry {
    let honest = nodes::registry();
    let kinds: Vec<_> = honest.kinds().collect();
    let honest = Arc::new(honest);
    kinds.into_iter().fold(Registry::default(), |registry, other| {
        registry.with(Perhaps { kind: other, honest: Arc::clone(&honest), lies: other == kind })
    })
}

/// A node type of fits whose outputs may be wrong.
struct Perhaps {
    kind: &'static str,
    honest: Arc<Registry>,
    lies: bool,
}

impl NodeType for Perhaps {
    fn kind(&self) -> &'static str {
        self.kind
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let mut output = self.honest.run(self.kind, parameters, inputs, context)?.to_vec();
        // Outputs are mostly numbers; this changes one of them.
        let middle = output.len() / 2;
        output.get_mut(middle).into_iter().for_each(|byte| *byte ^= u8::from(self.lies));
        Ok(output)
    }
}

/// The hash of parameters and inputs: 32 bytes that depend on every bit and on the order.
struct Digest;

impl NodeType for Digest {
    fn kind(&self) -> &'static str {
        "digest"
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let mut hashes = parameters.to_vec();
        for input in inputs {
            let decoded = context.decoded(input, |bytes| Ok::<_, NodeFailure>(BlobHash::of(bytes)))?;
            hashes.extend(decoded.0);
        }
        Ok(BlobHash::of(&hashes).0.to_vec())
    }
}

/// As many bytes as the parameters say (eight bytes, little-endian), made from the inputs.
struct Grow;

impl NodeType for Grow {
    fn kind(&self) -> &'static str {
        "grow"
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let length = parameters.try_into().map(u64::from_le_bytes).ok().and_then(|length| usize::try_from(length).ok());
        let length = length.ok_or_else(|| NodeFailure::new("expected a length of eight bytes"))?;
        let seed = BlobHash::of(&inputs.iter().flat_map(|input| input.hash().0).collect::<Vec<_>>());
        Ok(seed.0.iter().copied().cycle().take(length).collect())
    }
}

/// An application error with the parameters as its message.
struct Fail;

impl NodeType for Fail {
    fn kind(&self) -> &'static str {
        "fail"
    }

    fn run(&self, parameters: &[u8], _: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        Err(NodeFailure::new(String::from_utf8_lossy(parameters)))
    }
}

/// Panics.
struct Panic;

impl NodeType for Panic {
    fn kind(&self) -> &'static str {
        "panic"
    }

    #[expect(clippy::panic, reason = "its purpose")]
    fn run(&self, _: &[u8], _: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        panic!("asked to panic")
    }
}

/// Aborts its process. If the parameters name a file, it creates the file and aborts only once.
struct Abort;

impl NodeType for Abort {
    fn kind(&self) -> &'static str {
        "abort"
    }

    fn run(&self, parameters: &[u8], _: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let path = String::from_utf8_lossy(parameters);
        let marker = Path::new(path.as_ref());
        if marker.exists() {
            return Ok(b"survived".to_vec());
        }
        if !path.is_empty() {
            std::fs::write(marker, "").map_err(|error| NodeFailure::new(error.to_string()))?;
        }
        std::process::abort()
    }
}

/// Sends the id of its process to a listener and waits for one byte. The parameters are the listener's address; text after a `#` makes
/// nodes different. The test thus knows that the node executes (and is a quarter done), decides when it continues, and sees the end of
/// the process as the end of the stream.
struct Gate;

impl NodeType for Gate {
    fn kind(&self) -> &'static str {
        "gate"
    }

    fn run(&self, parameters: &[u8], _: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        context.report(1, 4);
        let pass = || -> std::io::Result<()> {
            let text = String::from_utf8_lossy(parameters);
            let mut stream = TcpStream::connect(text.split('#').next().unwrap_or_default())?;
            stream.write_all(&std::process::id().to_le_bytes())?;
            stream.read_exact(&mut [0])
        };
        pass().map(|()| b"passed".to_vec()).map_err(|error| NodeFailure::new(format!("the gate is gone: {error}")))
    }
}

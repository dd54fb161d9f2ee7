//! Real processes: signals to them, and waiting with a time limit.

use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};

/// A process that is killed on drop.
#[derive(Debug)]
pub struct Process(Option<Child>);

impl Process {
    /// Start it with its outputs captured.
    ///
    /// # Panics
    /// When it cannot be started.
    #[must_use]
    pub fn start(command: &mut Command) -> Self {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(Some(command.spawn().expect("a program that can be started")))
    }

    /// Its process id.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.0.as_ref().map_or(0, Child::id)
    }

    /// Read its stderr up to the first line that `pick` accepts; each line as JSON if it is JSON. `None` if the stream ends before. Later
    /// output is lost.
    ///
    /// # Panics
    /// When it cannot be read.
    pub fn stderr_until<T>(&mut self, mut pick: impl FnMut(&Value) -> Option<T>) -> Option<T> {
        let stderr = self.0.as_mut().and_then(|child| child.stderr.take()).expect("a process that is watched once");
        BufReader::new(stderr).lines().find_map(|line| {
            let line = line.expect("lines of text");
            pick(&serde_json::from_str(&line).unwrap_or(Value::String(line)))
        })
    }

    /// Read its stderr in a separate thread; each line as JSON if it is JSON. The thread reads until this process and all that share its
    /// stderr have ended. Lines are copied to `log`.
    ///
    /// # Panics
    /// When its stderr is already being read.
    pub fn follow_stderr(&mut self, mut log: impl Write + Send + 'static) -> Receiver<Value> {
        let stderr = self.0.as_mut().and_then(|child| child.stderr.take()).expect("a process that is watched once");
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                // The log helps to explain a failure; the receiver may be gone.
                let _ = writeln!(log, "{line}");
                let _ = sender.send(serde_json::from_str(&line).unwrap_or(Value::String(line)));
            }
        });
        lines
    }

    /// Whether it has ended.
    ///
    /// # Panics
    /// When the system cannot say.
    pub fn has_ended(&mut self) -> bool {
        self.0.as_mut().is_none_or(|child| child.try_wait().expect("a child of ours").is_some())
    }

    /// Kill it with SIGKILL and wait for its end. Processes that it has started continue.
    ///
    /// # Panics
    /// When it cannot be killed.
    pub fn kill(mut self) {
        let mut child = self.0.take().expect("a process that was not waited for");
        child.kill().expect("a process that can be killed");
        child.wait().expect("an end");
    }

    /// Wait for its end and that of all processes that share its stderr. `watch` gets all lines so far after each new line: JSON where a
    /// line is JSON, else a string.
    ///
    /// # Panics
    /// When it cannot be waited for, or its output is not UTF-8.
    #[must_use]
    pub fn watch_stderr(mut self, mut watch: impl FnMut(&[Value])) -> (Output, Vec<Value>) {
        let stderr = self.0.as_mut().and_then(|child| child.stderr.take()).expect("a process that is watched once");
        let mut lines = Vec::new();
        for line in BufReader::new(stderr).lines() {
            let line = line.expect("lines of text");
            lines.push(serde_json::from_str(&line).unwrap_or(Value::String(line)));
            watch(&lines);
        }
        (self.output(), lines)
    }

    /// Wait for its end.
    ///
    /// # Panics
    /// When it cannot be waited for.
    #[must_use]
    pub fn output(mut self) -> Output {
        self.0.take().expect("a process that is waited for once").wait_with_output().expect("an end")
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            // An error means that it has ended.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Kill a process with SIGKILL; it may have ended already.
///
/// # Panics
/// When the id is 0 or 1.
pub fn kill_if_alive(process: u32) {
    signal_if_there(process, "KILL");
}

/// Send a signal, such as `KILL`, to one process.
///
/// # Panics
/// When there is no such process.
pub fn signal(process: u32, name: &str) {
    assert!(signal_if_there(process, name), "cannot send {name} to process {process}");
}

/// Send a signal by its name to a process of the test that may have ended. Returns whether it was there.
///
/// # Panics
/// For a process that no test starts.
pub fn signal_if_there(process: u32, name: &str) -> bool {
    assert!(process > 1, "not a process of ours: {process}");
    let status = Command::new("sh").args(["-c", &format!("kill -{name} {process}")]).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

/// The standard error of a process as text.
#[must_use]
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

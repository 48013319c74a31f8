//! A command at work, watched and told when to end; and the document of one that has ended.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStdout, Command, Output, Stdio};

use serde_json::Value;

/// A process whose first line on stdout has been read. Killed if the test fails.
pub(crate) struct Running {
    child: Child,
    stdout: BufReader<ChildStdout>,
    /// That line, without its end.
    pub(crate) first_line: String,
}

impl Running {
    /// Starts the command and waits for the line.
    pub(crate) fn start(mut command: Command) -> Self {
        let mut child = command.stderr(Stdio::null()).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut first_line = String::new();
        stdout.read_line(&mut first_line).unwrap();
        Self {
            child,
            stdout,
            first_line: first_line.trim_end().to_owned(),
        }
    }

    /// As Ctrl-C does.
    pub(crate) fn interrupt(&self) {
        let number = self.child.id().to_string();
        let killed = Command::new("kill").args(["-INT", &number]).status();
        assert!(killed.unwrap().success());
    }

    /// What else it printed, and its exit code.
    pub(crate) fn finish(mut self) -> (String, Option<i32>) {
        let mut rest = String::new();
        self.stdout.read_to_string(&mut rest).unwrap();
        let status = self.child.wait().unwrap();
        (rest, status.code())
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The JSON document on stdout; if there is none, the test fails with the reason and stderr.
pub(crate) fn document(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stderr);
    let document = serde_json::from_slice(&output.stdout);
    document
        .map_err(|why| format!("{why}; stderr: {text}"))
        .unwrap()
}

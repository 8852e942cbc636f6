//! A folder that commands are run in.

use std::fs;
use std::path::PathBuf;
use std::process::Command as Process;
use std::time::Duration;

use assert_cmd::Command;
use tempfile::TempDir;

/// An empty folder that commands are run in.
pub struct Folder(pub TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    /// `servosim` with arguments separated by spaces.
    pub fn servosim(&self, arguments: &str) -> Command {
        let mut command = Command::from_std(self.process(arguments));
        command.timeout(Duration::from_mins(2));
        command
    }

    pub fn process(&self, arguments: &str) -> Process {
        let mut process = Process::new(env!("CARGO_BIN_EXE_servosim"));
        process.current_dir(self.0.path()).args(arguments.split(' ').filter(|a| !a.is_empty()));
        process.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
        process
    }
}

//! What was meant by a subcommand that there is not.

use clap::Error;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use strsim::jaro_winkler;

/// What other programs call it, and what it is called here.
const OTHER_WORDS: [(&str, &str); 34] = [
    ("simulate", "run"),
    ("sim", "run"),
    ("start", "run"),
    ("exec", "run"),
    ("execute", "run"),
    ("analysis", "analyze"),
    ("analyse", "analyze"),
    ("bode", "analyze"),
    ("nyquist", "analyze"),
    ("margins", "analyze"),
    ("stability", "analyze"),
    ("tuning", "tune"),
    ("optimize", "tune"),
    ("optimise", "tune"),
    ("autotune", "tune"),
    ("validate", "check"),
    ("verify", "check"),
    ("lint", "check"),
    ("init", "new"),
    ("create", "new"),
    ("info", "inspect"),
    ("show", "inspect"),
    ("export", "inspect"),
    ("csv", "inspect"),
    ("draw", "plot"),
    ("graph", "plot"),
    ("circle", "measure"),
    ("response", "measure"),
    ("step", "measure"),
    ("ilc", "learn"),
    ("scan", "sweep"),
    ("montecarlo", "sweep"),
    ("diff", "compare"),
    ("cam", "toolpath"),
];

/// How alike two words must be for one to be a slip of the other.
const ALIKE: f64 = 0.87;

/// The error of a subcommand that there is not, with the one that was meant, or with none rather than an odd one.
pub(super) fn subcommand(mut error: Error) -> Error {
    if error.kind() != ErrorKind::InvalidSubcommand {
        return error;
    }
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidSubcommand) else { return error };
    let meant = meant(given);
    error.remove(ContextKind::SuggestedSubcommand);
    if let Some(meant) = meant {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![meant.to_owned()]));
    }
    error
}

fn meant(given: &str) -> Option<&'static str> {
    let given = given.to_lowercase();
    let known = OTHER_WORDS.iter().map(|(word, here)| (*word, *here)).chain(COMMANDS.map(|command| (command, command)));
    let alike = known.map(|(word, here)| (jaro_winkler(&given, word), here));
    alike.filter(|(share, _)| *share >= ALIKE).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, here)| here)
}

/// The commands.
const COMMANDS: [&str; 16] = [
    "run", "tune", "compare", "measure", "learn", "sweep", "merge", "plot", "test", "inspect", "analyze", "check",
    "new", "toolpath", "stepover", "schema",
];

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn slips_and_other_words_are_known_and_nothing_odd_is_suggested() {
        let listed: Vec<String> =
            super::super::Cli::command().get_subcommands().map(|command| command.get_name().to_owned()).collect();
        assert!(
            COMMANDS.iter().all(|command| listed.iter().any(|name| name == command)) && listed.len() >= COMMANDS.len()
        );
        for (given, wanted) in [
            ("analyse", Some("analyze")),
            ("simulate", Some("run")),
            ("tuning", Some("tune")),
            ("validate", Some("check")),
            ("swep", Some("sweep")),
            ("chekc", Some("check")),
            ("Plot", Some("plot")),
            ("compaer", Some("compare")),
            ("toolpaht", Some("toolpath")),
            ("frobnicate", None),
            ("x", None),
            ("alpha.toml", None),
        ] {
            assert_eq!(meant(given), wanted, "{given}");
        }
    }
}

//! `turbid completions` and `turbid man`: completions for shells and manual pages, made from the command line itself.

use super::{Arguments, terminal::say};
use clap::CommandFactory;
use clap_complete::Shell;
use std::io;
use std::path::Path;
use turbid::error::{Error, Result};
use turbid::output::write_bytes;

/// Prints the completions for a shell.
pub(super) fn completions(shell: Shell) {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "turbid", &mut script);
    say(&String::from_utf8_lossy(&script));
}

/// Writes `turbid.1`, and `turbid-VERB.1` for each verb.
pub(super) fn man(directory: &Path) -> Result<()> {
    for (name, page) in pages().map_err(|error| Error::io("write", directory, error))? {
        write_bytes(&directory.join(name), &page)?;
    }
    Ok(())
}

/// Names and texts of the manual pages.
fn pages() -> io::Result<Vec<(String, Vec<u8>)>> {
    let mut program = Arguments::command().disable_help_subcommand(true);
    program.build();
    let verbs = program.get_subcommands().filter(|verb| !verb.is_hide_set()).cloned();
    let pages = verbs.chain([program.clone()]).map(|command| {
        let page = clap_mangen::Man::new(command).manual("Turbid");
        let mut text = Vec::new();
        page.render(&mut text)?;
        Ok((page.get_filename(), text))
    });
    pages.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verbs() -> Vec<String> {
        let program = Arguments::command();
        program
            .get_subcommands()
            .filter(|verb| !verb.is_hide_set())
            .map(|verb| verb.get_name().into())
            .collect()
    }

    #[test]
    fn every_verb_has_a_manual_page_with_its_flags_and_that_of_the_program_names_them_all() {
        let pages = pages().unwrap();
        let page = |name: &str| {
            let (_, text) =
                pages.iter().find(|(file, _)| file == name).unwrap_or_else(|| panic!("no {name}"));
            String::from_utf8(text.clone()).unwrap().replace('\\', "")
        };
        for verb in verbs() {
            assert!(page("turbid.1").contains(&format!("turbid-{verb}(1)")), "{verb}");
            assert!(page(&format!("turbid-{verb}.1")).contains("SYNOPSIS"), "{verb}");
        }
        assert_eq!(pages.len(), verbs().len() + 1);
        assert!(page("turbid-run.1").contains("--max-walltime"));
        assert!(page("turbid.1").contains("130"), "no exit codes");
    }

    #[test]
    fn completions_of_every_shell_name_all_verbs() {
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish, Shell::Elvish, Shell::PowerShell] {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "turbid", &mut script);
            let script = String::from_utf8(script).unwrap();
            for verb in verbs() {
                assert!(script.contains(&verb), "{shell}: {verb}");
            }
        }
    }
}

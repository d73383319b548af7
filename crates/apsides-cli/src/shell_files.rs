//! `apsides completions` and `apsides man`: what a shell and its manual want of the program.

use std::path::Path;

use apsides::pipeline::whole_file::write_whole;
use clap::{Command, CommandFactory};
use clap_complete::Shell;

use crate::arguments::Arguments;
use crate::commands::{claim, made, probe_directory};
use crate::exit::{Exit, Refusal, lost, refusal};
use crate::output::{print, print_json, written};
use crate::speech::is_json;

/// Prints the script by which a shell completes the command line.
pub(crate) fn completions(shell: Shell) -> Result<Exit, Refusal> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "apsides", &mut script);
    print(&String::from_utf8_lossy(&script));
    Ok(Exit::Verified)
}

/// Prints the manual page, or writes it and one for each command into a directory.
pub(crate) fn man(out: Option<&Path>) -> Result<Exit, Refusal> {
    let mut program = Arguments::command();
    program.build();
    let Some(dir) = out else {
        print(&String::from_utf8_lossy(&page(program)?));
        return Ok(Exit::Verified);
    };
    probe_directory(dir)?;
    made(dir)?;
    let _lock = claim(dir)?;
    let mut pages = Vec::new();
    add(&program, &mut pages)?;
    let mut files = Vec::new();
    for (name, page) in pages {
        let path = dir.join(name);
        write_whole(&path, &page).map_err(lost(&path))?;
        files.push(path);
    }
    if is_json() {
        print_json(&serde_json::json!({ "files": files }))?;
    } else {
        print(written(&files).trim_start());
    }
    Ok(Exit::Verified)
}

/// Adds the pages of a command and of those below it.
fn add(command: &Command, pages: &mut Vec<(String, Vec<u8>)>) -> Result<(), Refusal> {
    let name = command.get_bin_name().unwrap_or(command.get_name()).replace(' ', "-");
    pages.push((format!("{name}.1"), page(command.clone().name(name))?));
    for below in command.get_subcommands().filter(|below| below.get_name() != "help") {
        add(below, pages)?;
    }
    Ok(())
}

fn page(command: Command) -> Result<Vec<u8>, Refusal> {
    let mut page = Vec::new();
    clap_mangen::Man::new(command).render(&mut page).map_err(refusal)?;
    Ok(page)
}

//! `turbid film`: the pictures of a run as a moving one.

use super::terminal::say;
use crate::report::PICTURE;
use clap::Args;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::directory::{self, refuse_input};
use turbid::output::picture::{Image, film as animated_png};
use turbid::output::write_atomically;

/// Input and output of `turbid film`.
#[derive(Debug, Args)]
pub(super) struct FilmArguments {
    /// Output directory of a run.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Name of the pictures, needed where a run has several: what the names of their files begin with.
    #[arg(long)]
    name: Option<String>,
    /// File to write: animated PNG (.png), which browsers show, or MP4 (.mp4), which needs the program ffmpeg. Default: DIR/NAME.png.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Pictures per second.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=120))]
    fps: u16,
}

pub(super) fn film(arguments: &FilmArguments) -> Result<()> {
    let (name, frames) = frames(&arguments.directory, arguments.name.as_deref())?;
    let out = arguments.out.clone().unwrap_or_else(|| arguments.directory.join(format!("{name}.png")));
    refuse_input(&out, &frames)?;
    let read = |path: &PathBuf| {
        let named = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", path.display()));
        input::read_unlinked(path, PICTURE).and_then(|bytes| Image::from_png(&bytes)).map_err(named)
    };
    let mut size = (0, 0);
    for path in &frames {
        let image = read(path).map_err(|source| Error::io("read", path, source))?;
        size = (size.0.max(image.width()), size.1.max(image.height()));
    }
    match out.extension().and_then(|extension| extension.to_str()) {
        Some("png") => write_atomically(&out, |file| {
            animated_png(file, size, (frames.len() as u32, arguments.fps), frames.iter().map(read))
        })?,
        Some("mp4") => mp4(&out, size, arguments.fps, frames.iter().map(read))?,
        _ => {
            return Err(Error::Input(format!("{}: the name of a film ends in .png or .mp4", out.display())));
        }
    }
    let seconds = frames.len() as f64 / f64::from(arguments.fps);
    say(&format!("{}: {} pictures `{name}`, {seconds:.1} s", out.display(), frames.len()));
    Ok(())
}

/// The pictures of a run of one name in the order of their steps, and that name.
fn frames(directory: &Path, name: Option<&str>) -> Result<(String, Vec<PathBuf>)> {
    let folder = directory.join(directory::PICTURES.name());
    let mut known = directory::pictures(directory)?;
    let names = known.keys().cloned().collect::<Vec<_>>().join("`, `");
    let chosen = match (name, known.len()) {
        (_, 0) => {
            let remedy = "DIR is the output directory of a run whose output.picture_every is not \"never\"";
            return Err(Error::Input(format!("{} holds no pictures of a run\n  {remedy}", folder.display())));
        }
        (Some(name), _) => name.to_owned(),
        (None, 1) => names.clone(),
        (None, _) => {
            let title = format!("{} holds pictures of several names: `{names}`", folder.display());
            return Err(Error::Input(format!("{title}\n  choose one with --name")));
        }
    };
    let Some(frames) = known.remove(&chosen) else {
        let title = format!("{} holds no pictures of the name `{chosen}`", folder.display());
        return Err(Error::Input(format!("{title}; it has `{names}`")));
    };
    if frames.len() < 2 {
        let remedy = "a film needs two: run again with a smaller output.picture_every";
        return Err(Error::Input(format!(
            "{} holds only one picture `{chosen}`\n  {remedy}",
            folder.display()
        )));
    }
    Ok((chosen, frames.into_iter().map(|(_, path, _)| path).collect()))
}

/// Writes an MP4 through the program ffmpeg, which gets the pictures on its input; the file appears whole.
///
/// The output is a file that is open already, so ffmpeg sees no name: neither one that it would take for an option or a protocol, nor a
/// link.
fn mp4(
    out: &Path,
    size: (u32, u32),
    fps: u16,
    mut frames: impl Iterator<Item = io::Result<Image>>,
) -> Result<()> {
    // H.264 takes even sizes.
    let size = (size.0.next_multiple_of(2), size.1.next_multiple_of(2));
    let mut command = Command::new("ffmpeg");
    command.args(["-nostdin", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s"]);
    command.arg(format!("{}x{}", size.0, size.1)).args(["-r", &fps.to_string(), "-i", "pipe:0"]);
    command.args(["-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p", "-f", "mp4", "file:/dev/stdout"]);
    write_atomically(out, |file| {
        let stdout = file.get_ref().try_clone()?;
        let spawned = command.stdin(Stdio::piped()).stdout(stdout).stderr(Stdio::piped()).spawn();
        let mut child = spawned.map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => io::Error::other(
                "an MP4 needs the program ffmpeg, which is not installed\n  install it, or write an animated PNG with --out \
                 FILE.png",
            ),
            kind => io::Error::new(kind, format!("cannot start ffmpeg: {error}")),
        })?;
        let mut input = child.stdin.take().expect("was asked for");
        let sent = frames.try_for_each(|frame| input.write_all(&frame?.rgb(size)?));
        drop(input);
        let ended = child.wait_with_output()?;
        if !ended.status.success() {
            let said = String::from_utf8_lossy(&ended.stderr);
            return Err(io::Error::other(format!("ffmpeg failed: {}", said.trim())));
        }
        sent
    })
}

//! Films of any other kind, through the program `ffmpeg` where there is one: its frames come through a pipe, one at a time.

use std::ffi::OsString;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use image::RgbImage;

use super::index::MAX_FRAMES;
use super::{FilmError, Pictures, Take, check_size, one_line, shrunk};

/// A film that another program decodes.
pub(super) struct Piped {
    ffmpeg: PathBuf,
    size: [u32; 2],
    frame_s: Option<f64>,
    count: usize,
}

/// Where the program is, by the search path.
pub(super) fn find(program: &str) -> Option<PathBuf> {
    let name = format!("{program}{}", std::env::consts::EXE_SUFFIX);
    std::env::split_paths(&std::env::var_os("PATH")?).map(|folder| folder.join(&name)).find(|p| p.is_file())
}

impl Piped {
    /// Asks what the film is; absent where there is no such program.
    pub(super) fn open(path: &Path, stop: &dyn Fn() -> bool) -> Result<Option<Self>, FilmError> {
        let (Some(ffmpeg), Some(ffprobe)) = (find("ffmpeg"), find("ffprobe")) else { return Ok(None) };
        let failed = |reason: String| FilmError::Ffmpeg { path: path.to_owned(), reason };
        let mut asked = Command::new(&ffprobe);
        asked.args(["-v", "error", "-protocol_whitelist", "file,pipe", "-select_streams", "v:0", "-count_packets"]);
        asked.args([
            "-show_entries",
            "stream=nb_read_packets,avg_frame_rate,width,height",
            "-of",
            "default=nw=1",
            "-i",
        ]);
        let mut probe = Running::start(asked.arg(argument(path)), path)?;
        let mut answer = String::new();
        let out = probe.child.stdout.take();
        if let Some(out) = out {
            // A few lines; what a broken program would write beyond them is not wanted.
            let read = BufReader::new(out).take(4096).read_to_string(&mut answer);
            read.map_err(|e| failed(e.to_string()))?;
        }
        if stop() {
            return Err(FilmError::Stopped);
        }
        let field = |name: &str| answer.lines().find_map(|l| l.strip_prefix(name)?.strip_prefix('='));
        let number = |name: &str| field(name).and_then(|v| v.trim().parse::<u32>().ok());
        let (Some(width), Some(height)) = (number("width"), number("height")) else {
            let said = probe.said();
            return Err(if said.is_empty() { FilmError::NoVideo { path: path.to_owned() } } else { failed(said) });
        };
        check_size(path, width, height)?;
        let count = number("nb_read_packets").unwrap_or(0) as usize;
        if count > MAX_FRAMES {
            return Err(FilmError::TooManyFrames { path: path.to_owned(), count: count as u64 });
        }
        let rate = field("avg_frame_rate").and_then(|r| {
            let (a, b) = r.split_once('/')?;
            Some(b.trim().parse::<f64>().ok()? / a.parse::<f64>().ok()?)
        });
        let mut film =
            Self { ffmpeg, size: [width, height], frame_s: rate.filter(|r| r.is_finite() && *r > 0.0), count };
        // What it shows is upright; only a frame tells its size for certain.
        let mut shown = None;
        let first = &mut |_: usize, image: RgbImage| {
            shown = Some([image.width(), image.height()]);
            std::ops::ControlFlow::Break(())
        };
        film.each(path, 0, 1, stop, first)?;
        film.size = shown.ok_or_else(|| FilmError::NoFrames { path: path.to_owned() })?;
        Ok(Some(film))
    }
}

/// The file as `ffmpeg` takes it: never for an option, never for an address.
fn argument(path: &Path) -> OsString {
    let mut text = OsString::from("file:");
    text.push(std::path::absolute(path).unwrap_or_else(|_| path.to_owned()));
    text
}

/// A program under way: ended when this is dropped, however that comes about.
struct Running {
    child: Child,
    complaints: Option<std::thread::JoinHandle<String>>,
}

impl Running {
    fn start(command: &mut Command, path: &Path) -> Result<Self, FilmError> {
        let failed = |e: std::io::Error| FilmError::Ffmpeg { path: path.to_owned(), reason: e.to_string() };
        let spawned = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = spawned.map_err(failed)?;
        // Its complaints are read aside, so that it never waits for them to be read.
        let complaints = child.stderr.take().and_then(|mut from| {
            let thread = std::thread::Builder::new().name("ffmpeg".to_owned());
            let read = move || {
                let mut kept = Vec::new();
                let mut block = [0; 1024];
                while let Ok(n @ 1..) = from.read(&mut block) {
                    if kept.len() < 4096 {
                        kept.extend_from_slice(block.get(..n).unwrap_or_default());
                    }
                }
                String::from_utf8_lossy(&kept).into_owned()
            };
            thread.spawn(read).ok()
        });
        Ok(Self { child, complaints })
    }

    /// Waits for its end; the first line that it complained in.
    fn said(&mut self) -> String {
        let _ = self.child.wait();
        let said = self.complaints.take().and_then(|t| t.join().ok()).unwrap_or_default();
        one_line(said.lines().find(|l| !l.trim().is_empty()).unwrap_or_default())
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Pictures for Piped {
    fn count(&self) -> usize {
        self.count
    }

    fn time_s(&self, index: usize) -> Option<f64> {
        self.frame_s.map(|s| s * index as f64)
    }

    fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The program decodes from the first frame on. Frames before the one asked for come through the pipe, too: while it was silent, it could
    /// not be stopped.
    fn each(
        &mut self,
        path: &Path,
        from: usize,
        by: usize,
        stop: &dyn Fn() -> bool,
        take: Take<'_>,
    ) -> Result<(), FilmError> {
        let mut asked = Command::new(&self.ffmpeg);
        asked.args(["-v", "error", "-nostdin", "-protocol_whitelist", "file,pipe", "-i"]).arg(argument(path));
        asked.args(["-map", "0:v:0", "-fps_mode", "passthrough"]);
        asked.args(["-pix_fmt", "rgb24", "-f", "image2pipe", "-c:v", "ppm", "-"]);
        let mut running = Running::start(&mut asked, path)?;
        let Some(out) = running.child.stdout.take() else { return Ok(()) };
        let mut reader = BufReader::with_capacity(1 << 20, out);
        let mut index = 0;
        loop {
            if stop() {
                return Err(FilmError::Stopped);
            }
            match picture(&mut reader, path)? {
                Some(image) => {
                    if index >= from && take(index, shrunk(image, by)).is_break() {
                        return Ok(());
                    }
                }
                None if index < self.count => {
                    let said = running.said();
                    let reason = if said.is_empty() { "the film ends before it".to_owned() } else { said };
                    return Err(FilmError::BadFrame { path: path.to_owned(), number: index + 1, reason });
                }
                None => return Ok(()),
            }
            index += 1;
            if index >= self.count {
                return Ok(());
            }
        }
    }
}

/// The next picture of a stream of PPM pictures; absent at its end.
fn picture(reader: &mut impl Read, path: &Path) -> Result<Option<RgbImage>, FilmError> {
    let mut words = [0_u32; 3];
    let mut magic = [0; 2];
    if reader.read_exact(&mut magic).is_err() {
        return Ok(None);
    }
    let odd = || FilmError::Ffmpeg { path: path.to_owned(), reason: "its pictures cannot be understood".to_owned() };
    if &magic != b"P6" {
        return Err(odd());
    }
    let mut byte = [0];
    for word in &mut words {
        let mut digits = 0;
        loop {
            reader.read_exact(&mut byte).map_err(|_| odd())?;
            match byte[0] {
                d @ b'0'..=b'9' if digits < 6 => {
                    *word = *word * 10 + u32::from(d - b'0');
                    digits += 1;
                }
                b if b.is_ascii_whitespace() => {
                    if digits > 0 {
                        break;
                    }
                }
                _ => return Err(odd()),
            }
        }
    }
    check_size(path, words[0], words[1])?;
    let mut image = RgbImage::new(words[0], words[1]);
    // Cut short in the middle of a picture: its end came before it.
    Ok(reader.read_exact(&mut image).ok().map(|()| image))
}

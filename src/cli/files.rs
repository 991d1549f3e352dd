//! Files that appear under their names when they are whole, and never in the place of what was read.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Stdout, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::exit::Failure;

/// A file that is written beside its name and takes it when it is done; a pipe, a device or standard output is written to at once.
#[derive(Debug)]
pub(super) struct Written {
    /// As it was asked for.
    path: PathBuf,
    /// Where links lead.
    target: PathBuf,
    to: To,
}

#[derive(Debug)]
enum To {
    Beside(NamedTempFile),
    AtOnce(File),
    Out(Stdout),
}

/// The name that means standard output.
pub(super) const STDOUT: &str = "-";

impl Written {
    /// A new file; what stands under its name stays until [`Self::finish`].
    ///
    /// # Errors
    /// Those of the folder, or of what stands there.
    pub(super) fn create(path: &Path) -> Result<Self, Failure> {
        let fail = |error| Failure::file(path, error);
        let (target, to) = To::of(path).map_err(fail)?;
        if let To::AtOnce(file) = &to
            && file.metadata().map_err(fail)?.is_file()
        {
            file.set_len(0).map_err(fail)?;
        }
        Ok(Self {
            path: path.to_owned(),
            target,
            to,
        })
    }

    /// The failure of this file.
    pub(super) fn failure(&self, error: io::Error) -> Failure {
        Failure::file(&self.path, error)
    }

    /// Whether what was written can be changed.
    pub(super) fn can_seek(&self) -> bool {
        matches!(self.to, To::Beside(_))
    }

    /// What can be changed, if it can.
    fn file(&mut self) -> io::Result<&mut File> {
        match &mut self.to {
            To::Beside(file) => Ok(file.as_file_mut()),
            To::AtOnce(file) => Ok(file),
            To::Out(_) => Err(io::ErrorKind::NotSeekable.into()),
        }
    }

    /// Adds all bytes or none, where the file can be cut.
    ///
    /// # Errors
    /// Those of the file.
    pub(super) fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        if !self.can_seek() {
            self.write_all(bytes)?;
            return self.flush();
        }
        let file = self.file()?;
        let before = file.stream_position()?;
        file.write_all(bytes).inspect_err(|_| {
            let _ = file.set_len(before);
            let _ = file.seek(SeekFrom::Start(before));
        })
    }

    /// Replaces the first bytes, where [`Self::can_seek`].
    ///
    /// # Errors
    /// Those of the file.
    pub(super) fn replace_start(&mut self, bytes: &[u8]) -> io::Result<()> {
        let file = self.file()?;
        file.seek(SeekFrom::Start(0))?;
        file.write_all(bytes)?;
        file.seek(SeekFrom::End(0)).map(drop)
    }

    /// The file takes its name.
    ///
    /// # Errors
    /// Those of the folder.
    pub(super) fn finish(self) -> Result<(), Failure> {
        match self.to {
            To::AtOnce(_) | To::Out(_) => Ok(()),
            To::Beside(file) => match file.persist(&self.target) {
                Ok(_) => Ok(()),
                Err(error) => Err(Failure::file(&self.path, error.error)),
            },
        }
    }
}

impl Write for Written {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.to {
            To::Beside(file) => file.write(bytes),
            To::AtOnce(file) => file.write(bytes),
            To::Out(out) => out.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.to {
            To::Beside(file) => file.flush(),
            To::AtOnce(file) => file.flush(),
            To::Out(out) => out.flush(),
        }
    }
}

impl Seek for Written {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file()?.seek(to)
    }
}

impl To {
    /// Where a path leads, and what is written to there; nothing has changed yet.
    fn of(path: &Path) -> io::Result<(PathBuf, Self)> {
        if path == Path::new(STDOUT) {
            return Ok((path.to_owned(), Self::Out(io::stdout())));
        }
        // `out/` is a folder, whether it is there or not.
        if path.as_os_str().as_encoded_bytes().ends_with(b"/") {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        let target = target(path)?;
        let to = Self::at(&target)?;
        Ok((target, to))
    }

    fn at(target: &Path) -> io::Result<Self> {
        let existing = match fs::metadata(target) {
            Ok(existing) => Some(existing),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(error),
        };
        let Some(existing) = existing else {
            return beside(target).map(Self::Beside);
        };
        // This fails where writing is not allowed, and for a folder.
        let file = OpenOptions::new().write(true).open(target)?;
        if !existing.is_file() {
            return Ok(Self::AtOnce(file));
        }
        match beside(target) {
            Ok(file) => {
                file.as_file().set_permissions(existing.permissions())?;
                Ok(Self::Beside(file))
            }
            // A file that may be written in a folder that may not.
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => Ok(Self::AtOnce(file)),
            Err(error) => Err(error),
        }
    }
}

/// A nameless neighbour with the permissions of a new file.
fn beside(target: &Path) -> io::Result<NamedTempFile> {
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
        .prefix(&format!(".{name}."))
        .suffix(".part")
        .tempfile_in(folder)
        // The name of a file that nobody asked for says nothing.
        .map_err(|error| {
            let missing = fs::metadata(folder).err();
            missing.unwrap_or_else(|| io::Error::from(error.kind()))
        })
}

/// Links followed at most.
const MOST_LINKS: usize = 40;

/// Where a path leads if it is a link, to nothing as yet perhaps.
fn target(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            Ok(to) => path = path.parent().unwrap_or(Path::new("")).join(to),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("too many links"))
}

/// Writes bytes to a new file.
///
/// # Errors
/// Those of the file.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut file = Written::create(path)?;
    file.append(bytes).map_err(|e| file.failure(e))?;
    file.finish()
}

/// That all of these can be written.
///
/// # Errors
/// [`Failure::File`].
pub(super) fn writable(outputs: &[&Path]) -> Result<(), Failure> {
    let check = |path: &&Path| To::of(path).map_err(|error| Failure::file(path, error));
    outputs.iter().try_for_each(|path| check(path).map(drop))
}

/// That none of these files is one of those that were read, under whatever name.
///
/// # Errors
/// [`Failure::Told`] with both names.
pub(super) fn spare<'a>(
    outputs: &[&Path],
    read: impl IntoIterator<Item = &'a Path>,
) -> Result<(), Failure> {
    if outputs.is_empty() {
        return Ok(());
    }
    for input in read {
        let same = |output: &&&Path| **output != Path::new(STDOUT) && same_file(output, input);
        if let Some(output) = outputs.iter().find(same) {
            let also = if *output == input {
                String::new()
            } else {
                format!(", which is {}", input.display())
            };
            return Err(Failure::told(
                "overwritten",
                format!(
                    "{}{also}: is read for this very run and would be overwritten; choose another name",
                    output.display()
                ),
            ));
        }
    }
    Ok(())
}

/// Whether two names are one file, through links of either sort.
#[cfg(unix)]
fn same_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |path| fs::metadata(path).map(|m| (m.dev(), m.ino())).ok();
    id(a).is_some() && id(a) == id(b)
}

/// Whether two names are one file, through symbolic links.
#[cfg(not(unix))]
fn same_file(a: &Path, b: &Path) -> bool {
    let id = |path| fs::canonicalize(path).ok();
    id(a).is_some() && id(a) == id(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_name_when_it_is_whole_and_loses_nothing_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        fs::write(&path, "old").unwrap();
        let mut file = Written::create(&path).unwrap();
        file.append(b"new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        drop(file);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        let mut file = Written::create(&path).unwrap();
        file.append(b"00new").unwrap();
        file.replace_start(b"11").unwrap();
        file.append(b"!").unwrap();
        file.finish().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "11new!");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay_and_what_may_not_be_written_is_not() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (
            folder.path().join("real.csv"),
            folder.path().join("link.csv"),
        );
        symlink("real.csv", &link).unwrap();
        write(&link, b"through a link to nothing").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).unwrap();
        write(&link, b"again").unwrap();
        assert_eq!(fs::read_to_string(&real).unwrap(), "again");
        assert_eq!(
            fs::metadata(&real).unwrap().permissions().mode() & 0o777,
            0o640
        );
        assert!(Written::create(folder.path()).is_err());
        assert!(Written::create(&folder.path().join("no/such.csv")).is_err());
        write(Path::new("/dev/null"), b"a device").unwrap();
        assert!(write(Path::new("/dev/full"), b"a device").is_err());
    }

    #[test]
    fn what_is_read_is_spared() {
        let folder = tempfile::tempdir().unwrap();
        let (read, hard) = (folder.path().join("in.csv"), folder.path().join("hard.csv"));
        fs::write(&read, "").unwrap();
        fs::hard_link(&read, &hard).unwrap();
        let other = folder.path().join("other.csv");
        spare(&[&other], [read.as_path()]).unwrap();
        for output in [&read, &hard, &folder.path().join("./in.csv")] {
            let said = spare(&[&other, output], [read.as_path()]).unwrap_err();
            assert!(said.to_string().contains("would be overwritten"), "{said}");
        }
    }
}

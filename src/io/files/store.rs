//! Mounted files: names for bytes that a program has. Knows no disk.
//!
//! Objects of a browser belong to one thread, so mounted files do too. An open file holds the number
//! of its source instead of the source itself, so it may be sent to another thread, where reading it
//! is an error.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::ffi::OsString;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use super::{Kind, Metadata};

/// Bytes that are read from a source at a time, if fewer are wanted. A call into a browser takes a
/// tenth of a millisecond.
const WINDOW: usize = 1 << 18;

/// Where the bytes of a mounted file come from: memory, a file of a browser, an archive.
pub trait FileSource {
    /// How many bytes there are. The number must not change.
    fn length(&self) -> u64;

    /// Reads bytes from `offset` on into the beginning of `bytes`, at least one unless the file ends
    /// there. Returns how many.
    ///
    /// # Errors
    /// If they cannot be read; the error's text is shown behind the file's name.
    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> io::Result<usize>;
}

impl FileSource for [u8] {
    fn length(&self) -> u64 {
        self.len() as u64
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> io::Result<usize> {
        let from = usize::try_from(offset).ok().and_then(|offset| self.get(offset..));
        from.unwrap_or_default().read(bytes)
    }
}

/// Sources that lead to bytes in memory.
macro_rules! of_bytes {
    ($($source:ty),*) => {$(
        impl FileSource for $source {
            fn length(&self) -> u64 {
                self.len() as u64
            }

            fn read_at(&self, offset: u64, bytes: &mut [u8]) -> io::Result<usize> {
                <[u8] as FileSource>::read_at(self, offset, bytes)
            }
        }
    )*};
}

of_bytes!(Vec<u8>, Arc<[u8]>, Rc<[u8]>, &'static [u8]);

impl FileSource for Box<dyn FileSource> {
    fn length(&self) -> u64 {
        (**self).length()
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> io::Result<usize> {
        (**self).read_at(offset, bytes)
    }
}

/// All mounted files of a thread.
#[derive(Default)]
struct Store {
    /// The number of each file by its plain path.
    names: BTreeMap<PathBuf, u64>,
    sources: HashMap<u64, Rc<dyn FileSource>>,
    mounted: u64,
}

thread_local! {
    static STORE: RefCell<Store> = RefCell::default();
}

/// Calls `work` with the thread's files. `work` must not call a source.
fn with<T: Default>(work: impl FnOnce(&mut Store) -> T) -> T {
    // While a thread ends, it has no files any more.
    STORE.try_with(|store| work(&mut store.borrow_mut())).unwrap_or_default()
}

/// Gives the bytes of `source` the name `path`: this thread then reads them wherever a file of that
/// name is named, by a call, by a scene file or by another file. What had that name before is
/// unmounted.
///
/// Paths are taken as they are written: `./a/../b` is `b`, and a relative path is not the absolute
/// one that may lead to the same place. Folders need not be made.
///
/// ```
/// use deepshadow::io;
///
/// let header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\
///               data file: cube.raw\n";
/// io::mount("case/cube.nhdr", header.as_bytes());
/// io::mount("case/cube.raw", vec![1, 2, 3, 4, 5, 6, 7, 8]);
/// assert_eq!(io::open("case/cube.nhdr")?.dims(), [2, 2, 2]);
/// io::unmount_all();
/// # Ok::<(), deepshadow::Error>(())
/// ```
pub fn mount(path: impl AsRef<Path>, source: impl FileSource + 'static) {
    let (name, source) = (plain(path.as_ref()), Rc::new(source));
    // What was there is dropped outside of the store, because it may use it.
    drop(with(|store| {
        store.mounted += 1;
        store.sources.insert(store.mounted, source);
        let before = store.names.insert(name, store.mounted);
        before.and_then(|number| store.sources.remove(&number))
    }));
}

/// Unmounts the file `path`, and returns whether it was mounted. Whoever is reading it fails.
pub fn unmount(path: impl AsRef<Path>) -> bool {
    let name = plain(path.as_ref());
    let number =
        with(|store| store.names.remove(&name).map(|number| store.sources.remove(&number)));
    number.is_some()
}

/// Unmounts all files of this thread.
pub fn unmount_all() {
    drop(with(|store| (std::mem::take(&mut store.names), std::mem::take(&mut store.sources))));
}

/// The path without `.`, and without `..` where that follows a folder.
pub(super) fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match (part, plain.components().next_back()) {
            (Component::CurDir, _) | (Component::ParentDir, Some(Component::RootDir)) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                plain.pop();
            }
            _ => plain.push(part),
        }
    }
    plain
}

/// Opens a mounted file; `None` if nothing is mounted there.
pub(super) fn open(path: &Path) -> Option<io::Result<MountedFile>> {
    let (number, source) = match metadata(path)?.kind {
        Some(Kind::File) => with(|store| {
            let number = *store.names.get(&plain(path))?;
            Some((number, store.sources.get(&number)?.clone()))
        })?,
        _ => return Some(Err(io::Error::new(io::ErrorKind::IsADirectory, "a folder"))),
    };
    let length = source.length();
    Some(Ok(MountedFile { number, length, at: 0, window: Vec::new(), window_at: 0 }))
}

/// What is mounted at `path`: a file, or a folder of files.
pub(super) fn metadata(path: &Path) -> Option<Metadata> {
    let source = with(|store| {
        if store.names.is_empty() {
            return None;
        }
        let name = plain(path);
        if let Some(number) = store.names.get(&name) {
            return Some(store.sources.get(number).cloned());
        }
        // Whatever is in the folder follows its name.
        let mut behind = store.names.range(name.clone()..);
        let is_folder = behind.next().is_some_and(|(other, _)| other.starts_with(&name));
        (is_folder && !name.as_os_str().is_empty()).then_some(None)
    })?;
    Some(match source {
        Some(source) => Metadata { kind: Some(Kind::File), len: source.length() },
        None => Metadata { kind: Some(Kind::Folder), len: 0 },
    })
}

/// The names of files and folders that are mounted in a folder.
pub(super) fn names_in(folder: &Path) -> Vec<OsString> {
    let folder = plain(folder);
    let name = |path: &PathBuf| match path.strip_prefix(&folder).ok()?.components().next()? {
        Component::Normal(name) => Some(name.to_owned()),
        _ => None,
    };
    let mut names: Vec<OsString> = with(|store| store.names.keys().filter_map(name).collect());
    // Files of one folder follow each other.
    names.dedup();
    names
}

/// An open mounted file.
#[derive(Debug)]
pub(super) struct MountedFile {
    number: u64,
    length: u64,
    at: u64,
    /// Bytes of the file from `window_at` on, for small reads.
    window: Vec<u8>,
    window_at: u64,
}

impl MountedFile {
    /// Bytes of the file.
    pub(super) fn len(&self) -> u64 {
        self.length
    }

    /// The bytes at the current place that were read already.
    fn ahead(&self) -> &[u8] {
        let used = self.at.checked_sub(self.window_at).and_then(|used| usize::try_from(used).ok());
        used.and_then(|used| self.window.get(used..)).unwrap_or_default()
    }
}

/// Reads from a source as much as it gives at once.
fn read_source(number: u64, offset: u64, bytes: &mut [u8]) -> io::Result<usize> {
    let source = with(|store| store.sources.get(&number).cloned());
    let lost = || io::Error::new(io::ErrorKind::NotFound, "no longer mounted on this thread");
    let length = bytes.len();
    source.ok_or_else(lost)?.read_at(offset, bytes).map(|read| read.min(length))
}

impl Read for MountedFile {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let left = usize::try_from(self.length.saturating_sub(self.at)).unwrap_or(usize::MAX);
        let wanted = bytes.len().min(left);
        if wanted == 0 {
            return Ok(0);
        }
        let read = if self.ahead().is_empty() && wanted >= WINDOW {
            read_source(self.number, self.at, &mut bytes[..wanted])?
        } else {
            if self.ahead().is_empty() {
                self.window.resize(WINDOW.min(left), 0);
                let read = read_source(self.number, self.at, &mut self.window);
                self.window.truncate(*read.as_ref().unwrap_or(&0));
                self.window_at = self.at;
                read?;
            }
            self.ahead().read(&mut bytes[..wanted])?
        };
        self.at += read as u64;
        Ok(read)
    }
}

impl Seek for MountedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let place = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(offset) => self.length.checked_add_signed(offset),
            SeekFrom::Current(offset) => self.at.checked_add_signed(offset),
        };
        let before = || io::Error::new(io::ErrorKind::InvalidInput, "a place before the file");
        self.at = place.ok_or_else(before)?;
        Ok(self.at)
    }
}

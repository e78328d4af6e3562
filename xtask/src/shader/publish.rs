//! Replacing the committed modules in one step.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::Error;

/// Makes a directory hold exactly these files. Everything is written beside it first, so an interrupted run leaves
/// either the old directory or the new one. Gives whether anything changed.
pub fn replace(directory: &Path, files: &BTreeMap<PathBuf, Vec<u8>>) -> Result<bool, Error> {
    if read_files(directory)? == *files {
        return Ok(false);
    }
    let parent = directory.parent().unwrap_or(Path::new("."));
    let staging =
        tempfile::Builder::new().prefix(".spirv-").tempdir_in(parent).map_err(Error::io("write in", parent))?;
    let (new, old) = (staging.path().join("new"), staging.path().join("old"));
    for (name, contents) in files {
        write(&new.join(name), contents)?;
    }
    if directory.exists() {
        std::fs::rename(directory, &old).map_err(Error::io("move", directory))?;
    }
    std::fs::rename(&new, directory).map_err(Error::io("replace", directory))?;
    Ok(true)
}

/// Writes a file, with the folders that lead to it.
pub fn write(path: &Path, contents: &[u8]) -> Result<(), Error> {
    let made = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    made.and_then(|()| std::fs::write(path, contents)).map_err(Error::io("write", path))
}

/// All files below a directory by relative path; a missing directory is empty.
pub fn read_files(directory: &Path) -> Result<BTreeMap<PathBuf, Vec<u8>>, Error> {
    let mut files = BTreeMap::new();
    if directory.is_dir() {
        collect(directory, Path::new(""), &mut files)?;
    }
    Ok(files)
}

fn collect(root: &Path, folder: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) -> Result<(), Error> {
    let path = root.join(folder);
    for entry in std::fs::read_dir(&path).map_err(Error::io("read", &path))? {
        let entry = entry.map_err(Error::io("read", &path))?;
        let name = folder.join(entry.file_name());
        if entry.path().is_dir() {
            collect(root, &name, files)?;
        } else {
            let contents = std::fs::read(entry.path()).map_err(Error::io("read", &entry.path()))?;
            files.insert(name, contents);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stale_files_go_and_equal_contents_stay() {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("spirv");
        let files = |names: &[&str]| names.iter().map(|n| (PathBuf::from(n), n.as_bytes().to_vec())).collect();
        assert!(replace(&directory, &files(&["exact/a.spv", "exact/b.spv"])).unwrap());
        assert!(replace(&directory, &files(&["exact/b.spv", "fast/b.spv"])).unwrap());
        assert_eq!(read_files(&directory).unwrap(), files(&["exact/b.spv", "fast/b.spv"]));
        assert!(!replace(&directory, &files(&["exact/b.spv", "fast/b.spv"])).unwrap());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "the staging folder stays behind");
    }
}

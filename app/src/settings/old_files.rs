//! `--resume` and `--force`: what a run does with files that exist.

/// What a run does with existing files. It never replaces an input of its own.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum OldFiles {
    /// Refuse them.
    #[default]
    Refuse,
    /// Resume the run that wrote them, if there is one.
    Resume,
    /// Replace files with our names.
    Replace,
    /// Replace them if they are those of a demo.
    ReplaceDemo,
}

//! `lookalike study`.

use super::{cluster::ClusterArgs, fit::DiagnosticsArgs};
use crate::settings::StudySettings;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(args_override_self = true, after_long_help = EXAMPLES)]
pub(crate) struct StudyArgs {
    /// TOML file that names materials, lights and experiments
    #[arg(value_name = "STUDY.toml")]
    study: PathBuf,
    /// Folder of results; must not hold a run, unless --resume goes on with it
    #[arg(long, short, value_name = "DIR", help_heading = "Output")]
    out: PathBuf,
    /// Go on with the study that is in the folder: what is complete is not computed again. Of a complete one, write the report again
    #[arg(long, help_heading = "Output")]
    resume: bool,
    #[command(flatten)]
    cluster: ClusterArgs,
    #[command(flatten)]
    diagnostics: DiagnosticsArgs,
}

impl StudyArgs {
    pub(crate) fn into_settings(self) -> anyhow::Result<StudySettings> {
        let command = format!("lookalike study {} --out {}", self.study.display(), self.out.display());
        Ok(StudySettings {
            study: self.study,
            out: self.out,
            resume: self.resume,
            metrics: self.diagnostics.metrics,
            cluster: self.cluster.into_settings()?,
            progress: self.diagnostics.progress,
            command,
        })
    }
}

const EXAMPLES: &str = "\
Examples:
  lookalike study STUDY.toml --out study
  lookalike study STUDY.toml --out study --resume
  lookalike study STUDY.toml --out study --workers 0 --listen 10.0.0.1:4100

where STUDY.toml is, for instance (its relative paths are relative to the file):
  materials = [\"merl/*.binary\"]           # measured materials in MERL's format
  probes = [\"grace_cross.hdr\", \"rnl_cross.hdr\", \"uffizi.hdr\"]
  held-out = [\"studio.hdr\"]               # lights to show matches under, never to fit to
  size = 128                              # columns and rows of the photos
  experiments = [\"methods\", \"held-out\"]  # all of them, if left out

docs/study.md has the whole grammar. The report is OUT/report.html, for people, and OUT/results.md, for a repository.";

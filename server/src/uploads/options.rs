//! The part of the command line that is about what people bring.

use std::path::PathBuf;

use clap::Args;

use crate::limits::UploadLimits;

/// See the module.
#[derive(Debug, Clone, Args)]
pub struct UploadOptions {
    /// Let people bring scene files of their own: whoever may connect may drop them on the page. What nobody looks at for --scene-idle-s is removed
    #[arg(long, conflicts_with = "publish")]
    pub allow_uploads: bool,
    /// Size of what one person brings at once at most, unpacked
    #[arg(long, value_name = "MIB", default_value_t = UploadLimits::default().bytes >> 20, value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    pub upload_size: u64,
    /// Room on the disk for all that people bring
    #[arg(long, value_name = "MIB", default_value_t = UploadLimits::default().all_bytes >> 20, value_parser = clap::value_parser!(u64).range(1..=1 << 24))]
    pub upload_space: u64,
    /// A folder to keep it in, in a folder of its own that is removed at the end; without it, where the system keeps what is temporary
    #[arg(long, value_name = "FOLDER", requires = "allow_uploads")]
    pub upload_folder: Option<PathBuf>,
}

impl UploadOptions {
    /// As plain values.
    pub fn limits(&self) -> UploadLimits {
        UploadLimits { bytes: self.upload_size << 20, all_bytes: self.upload_space << 20, ..UploadLimits::default() }
    }
}

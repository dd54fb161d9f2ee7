//! The kind of file system that a journal lies on. On a network file system, SQLite cannot share memory between processes, and
//! its locks may not be seen by all machines; there the coordinator locks the journal for itself.

use std::path::Path;

/// Whether a folder lies on a file system that other machines may write to.
#[cfg(target_os = "linux")]
pub(super) fn is_shared(folder: &Path) -> bool {
    nix::sys::statfs::statfs(folder).is_ok_and(|system| is_network(i128::from(system.filesystem_type().0)))
}

/// Whether a folder lies on a file system that other machines may write to: unknown on this system.
#[cfg(not(target_os = "linux"))]
pub(super) fn is_shared(_folder: &Path) -> bool {
    false
}

/// The magic numbers of network file systems, from statfs(2) and the kernel's headers.
#[cfg(target_os = "linux")]
const NETWORK: [(&str, u32); 14] = [
    ("9p", 0x0102_1997),
    ("afs", 0x5346_414F),
    ("beegfs", 0x1983_0326),
    ("ceph", 0x00C3_6400),
    ("cifs", 0xFF53_4D42),
    ("coda", 0x7375_7245),
    // sshfs, gluster, s3fs and many more. If such a file system is local, other processes only
    // read `status.json` instead of the journal.
    ("fuse", 0x6573_5546),
    ("gpfs", 0x4750_4653),
    ("lustre", 0x0BD0_0BD0),
    ("nfs", 0x0000_6969),
    ("ocfs2", 0x7461_636F),
    ("panfs", 0xAAD7_AAEA),
    ("smb", 0x0000_517B),
    ("smb2", 0xFE53_4D42),
];

#[cfg(target_os = "linux")]
fn is_network(kind: i128) -> bool {
    // The kernel's type is signed on some machines, so only the low 32 bits are compared.
    NETWORK.iter().any(|(_, magic)| kind & 0xFFFF_FFFF == i128::from(*magic))
}

#[cfg(test)]
mod tests {
    #[cfg(target_os = "linux")]
    #[test]
    fn network_file_systems_are_recognised_by_their_numbers() {
        use super::{Path, is_network, is_shared};
        assert!(is_network(0x6969) && is_network(0xFE53_4D42));
        // As a signed 32-bit number.
        assert!(is_network(i128::from(0xFF53_4D42_u32.cast_signed())));
        // ext4, tmpfs, xfs.
        assert!(![0xEF53, 0x0102_1994, 0x5846_5342].into_iter().any(is_network));
        assert!(!is_shared(Path::new("/proc")));
    }
}

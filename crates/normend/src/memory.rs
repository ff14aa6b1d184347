//! How much memory the program has used.

/// The largest resident set of this process so far, in bytes; `None` where the system does not tell (only Linux does,
/// as `VmHWM` in `/proc/self/status`, see proc(5)).
pub fn peak_rss_bytes() -> Option<u64> {
    peak_rss_in(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// Finds `VmHWM:   123 kB` in the text of a status file.
fn peak_rss_in(status: &str) -> Option<u64> {
    let value = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = value.trim().strip_suffix("kB")?.trim_end().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_peak_from_a_status_file() {
        fn check(status: &str, expect: Option<u64>) {
            assert_eq!(peak_rss_in(status), expect, "{status:?}");
        }
        check(
            "Name:\tnormend\nVmPeak:\t  9000 kB\nVmHWM:\t   812 kB\n",
            Some(812 * 1024),
        );
        check("VmHWM:\t99999999999999999999 kB", None);
        check("VmHWM:\t812 MB", None);
        check("Name:\tnormend\n", None);
        check("", None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_process_has_a_peak() {
        let peak = peak_rss_bytes().unwrap();
        assert!(peak > 100_000, "{peak} bytes cannot hold a test program");
    }
}

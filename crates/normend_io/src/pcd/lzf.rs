//! LZF, in which the columns of packed PCD files are compressed, a piece at a time.
//!
//! The format is that of LibLZF (Marc Lehmann): bytes as they are, in runs of up to 32, and repetitions of up to 264 bytes
//! that occurred within the last 8192. `pcd_rs` unpacks it for itself only, all at once and several times over in memory, and
//! the crate `lzf` is given up by its author and refuses what does not get smaller; so these few lines are here. A test has
//! `pcd_rs` read what they pack.

use crate::error::{Broken, Place, Stop};

/// How far back a repetition may reach.
const WINDOW: usize = 1 << 13;
/// The longest run of bytes as they are.
const MOST_PLAIN: usize = 1 << 5;
/// The shortest and the longest repetition.
const LEAST_REPEATED: usize = 3;
const MOST_REPEATED: usize = 264;
/// Unpacked bytes that are handed on at a time.
const PIECE: usize = 1 << 18;

/// What comes next in packed bytes.
enum Run<'a> {
    /// Bytes as they are.
    Plain(&'a [u8]),
    /// `length` bytes that stand `distance` before; the two may overlap.
    Repeated { distance: usize, length: usize },
}

/// Splits what comes next off; `None` when it is cut off.
#[inline]
fn next_run<'a>(packed: &mut &'a [u8]) -> Option<Run<'a>> {
    let (&control, rest) = packed.split_first()?;
    let control = usize::from(control);
    if control < MOST_PLAIN {
        let (plain, rest) = rest.split_at_checked(control + 1)?;
        *packed = rest;
        return Some(Run::Plain(plain));
    }
    let (more, rest) = match control >> 5 {
        7 => rest.split_first()?,
        _ => (&0, rest),
    };
    let (&low, rest) = rest.split_first()?;
    *packed = rest;
    Some(Run::Repeated {
        distance: ((control & 0x1f) << 8) + usize::from(low) + 1,
        length: (control >> 5) + usize::from(*more) + 2,
    })
}

fn broken(byte: usize) -> Broken {
    Broken::new(
        Place::Byte(byte),
        "the packed points are damaged here: copy or export the file again",
    )
}

/// The number of bytes that `packed` unpacks to, found without unpacking it: at most 88 times as many. `at` is where it stands
/// in the file, for messages.
///
/// # Errors
/// A repetition of what is before the beginning, an end within a run.
pub(crate) fn unpacked_size(packed: &[u8], at: usize) -> Result<usize, Broken> {
    let mut rest = packed;
    let mut n_unpacked = 0;
    while !rest.is_empty() {
        let here = at + packed.len() - rest.len();
        n_unpacked += match next_run(&mut rest) {
            Some(Run::Plain(plain)) => plain.len(),
            Some(Run::Repeated { distance, length }) if distance <= n_unpacked => length,
            _ => return Err(broken(here)),
        };
    }
    Ok(n_unpacked)
}

/// Unpacks `packed`, of which [`unpacked_size`] has been found, and hands what it was to `take`, some of it at a time. Takes no
/// memory but for that.
///
/// # Errors
/// What `take` returns, and those of [`unpacked_size`].
pub(crate) fn unpack(packed: &[u8], at: usize, mut take: impl FnMut(&[u8]) -> Result<(), Stop>) -> Result<(), Stop> {
    let mut piece = Vec::with_capacity(WINDOW + PIECE + MOST_REPEATED);
    // Bytes at the beginning of the piece that were handed on, and stay for repetitions of them.
    let mut n_taken = 0;
    let mut rest = packed;
    while !rest.is_empty() {
        let here = at + packed.len() - rest.len();
        match next_run(&mut rest).ok_or_else(|| broken(here))? {
            Run::Plain(plain) => piece.extend_from_slice(plain),
            Run::Repeated { distance, length } => {
                let from = piece.len().checked_sub(distance).ok_or_else(|| broken(here))?;
                if length <= distance {
                    piece.extend_from_within(from..from + length);
                } else {
                    (from..from + length).for_each(|index| piece.push(piece[index]));
                }
            }
        }
        if piece.len() >= WINDOW + PIECE {
            take(&piece[n_taken..])?;
            piece.drain(..piece.len() - WINDOW);
            n_taken = WINDOW;
        }
    }
    take(&piece[n_taken..])
}

/// Appends `bytes`, packed. Packed pieces one after the other are the pieces packed, so these can be made in any order.
pub(crate) fn pack(bytes: &[u8], out: &mut Vec<u8>) {
    const HASH_BITS: u32 = 14;
    // The last place, plus one, at which three bytes of some hash were seen.
    let mut seen = vec![0_u32; 1 << HASH_BITS];
    let hash = |at: usize| {
        let three = u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], 0]);
        (three.wrapping_mul(0x9e37_79b1) >> (32 - HASH_BITS)) as usize
    };
    let mut first_plain = 0;
    let mut at = 0;
    while at + LEAST_REPEATED <= bytes.len() {
        let slot = &mut seen[hash(at)];
        let former = (*slot as usize).checked_sub(1);
        *slot = at as u32 + 1;
        let is_repeated =
            |from: &usize| at - from <= WINDOW && bytes[*from..from + LEAST_REPEATED] == bytes[at..at + LEAST_REPEATED];
        let Some(from) = former.filter(is_repeated) else {
            at += 1;
            continue;
        };
        push_plain(&bytes[first_plain..at], out);
        let most = MOST_REPEATED.min(bytes.len() - at);
        let length = (LEAST_REPEATED..most)
            .find(|&length| bytes[from + length] != bytes[at + length])
            .unwrap_or(most);
        let distance = at - from - 1;
        let high = (distance >> 8) as u8;
        match length - 2 {
            short @ ..7 => out.push((short as u8) << 5 | high),
            long => out.extend([7 << 5 | high, (long - 7) as u8]),
        }
        out.push(distance as u8);
        at += length;
        first_plain = at;
    }
    push_plain(&bytes[first_plain..], out);
}

fn push_plain(bytes: &[u8], out: &mut Vec<u8>) {
    for run in bytes.chunks(MOST_PLAIN) {
        out.push((run.len() - 1) as u8);
        out.extend_from_slice(run);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn unpacked(packed: &[u8]) -> Result<Vec<u8>, Broken> {
        let size = unpacked_size(packed, 100);
        let mut all = Vec::new();
        let result = unpack(packed, 100, |piece| {
            all.extend_from_slice(piece);
            Ok(())
        });
        match result {
            Ok(()) => {
                assert_eq!(size, Ok(all.len()));
                Ok(all)
            }
            Err(Stop::Broken(broken)) => {
                assert_eq!(size, Err(broken.clone()));
                Err(broken)
            }
            Err(Stop::Cancelled(_)) => unreachable!("nobody cancels"),
        }
    }

    #[test]
    fn repetitions_are_found_and_reach_as_far_as_they_may() {
        let check = |bytes: &[u8], most: usize| {
            let mut packed = Vec::new();
            pack(bytes, &mut packed);
            assert_eq!(unpacked(&packed).unwrap(), bytes);
            assert!(packed.len() <= most, "{} bytes of {}", packed.len(), bytes.len());
        };
        check(b"", 0);
        check(b"a", 2);
        check(&[7; 1_000_000], 3 * (1_000_000 / 264 + 2));
        // The beginning is repeated after exactly, and after a little more than, what a repetition can reach.
        for (distance, is_reached) in [(WINDOW, true), (WINDOW + 1, false)] {
            let mut bytes: Vec<u8> = (0..distance as u32)
                .flat_map(|index| (index * index).to_le_bytes())
                .collect();
            bytes.truncate(distance);
            bytes[..4].copy_from_slice(&[250, 251, 252, 253]);
            bytes.extend([250, 251, 252, 253]);
            let mut packed = Vec::new();
            pack(&bytes, &mut packed);
            assert_eq!(unpacked(&packed).unwrap(), bytes);
            assert_eq!(packed.ends_with(&[2 << 5 | 31, 255]), is_reached);
        }
    }

    #[test]
    fn pieces_are_packed_on_their_own_and_unpacked_in_steps() {
        let bytes: Vec<u8> = (0..3 * PIECE).map(|index| (index / 3 % 251) as u8).collect();
        let mut packed = Vec::new();
        bytes.chunks(100_000).for_each(|piece| pack(piece, &mut packed));
        assert_eq!(unpacked(&packed).unwrap(), bytes);
        let mut largest = 0;
        let result = unpack(&packed, 0, |piece| {
            largest = largest.max(piece.len());
            Ok(())
        });
        assert!(result.is_ok() && largest <= WINDOW + PIECE + MOST_REPEATED);
    }

    #[test]
    fn damage_is_named_with_its_byte() {
        let check = |packed: &[u8], byte: usize| {
            let broken = unpacked(packed).unwrap_err();
            assert_eq!(broken.place, Place::Byte(100 + byte));
        };
        check(&[3, 1, 2], 0);
        check(&[0, 1, 0x20], 2);
        check(&[0, 1, 0xe0, 5], 2);
        check(&[0, 1, 0x20, 1], 2);
        check(&[0x20, 0], 0);
    }

    proptest! {
        #[test]
        fn anything_comes_back(bytes in proptest::collection::vec(0_u8..4, 0..20_000), step in 1_usize..9000) {
            let mut packed = Vec::new();
            bytes.chunks(step).for_each(|piece| pack(piece, &mut packed));
            prop_assert_eq!(unpacked(&packed).unwrap(), bytes);
        }

        #[test]
        fn damaged_bytes_are_unpacked_or_refused(packed in proptest::collection::vec(any::<u8>(), 0..2000)) {
            if let Ok(bytes) = unpacked(&packed) {
                prop_assert!(bytes.len() <= 88 * packed.len());
            }
        }
    }
}

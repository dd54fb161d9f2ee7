//! Comparison of an embedded ICC profile with sRGB, which is assumed. Only matrix profiles are examined (ICC.1:2022,
//! tags `rXYZ gXYZ bXYZ` and `rTRC`, or `kTRC` of a grey profile). The profile is not applied.

/// The first contradiction to sRGB in `profile`, in words.
pub(super) fn contradiction(profile: &[u8]) -> Option<&'static str> {
    let Some(space) = profile.get(16..20) else { return Some("its ICC profile is broken") };
    if space == b"GRAY" {
        return tone_contradiction(tag(profile, b"kTRC"));
    }
    if space != b"RGB " {
        return Some("its ICC profile is not for RGB");
    }
    for (name, expected) in [(b"rXYZ", SRGB_RED), (b"gXYZ", SRGB_GREEN), (b"bXYZ", SRGB_BLUE)] {
        let Some(found) = tag(profile, name).and_then(xyz) else {
            return Some("its ICC profile is not a matrix profile");
        };
        if found.iter().zip(expected).any(|(a, b)| (a - b).abs() > 2e-3) {
            return Some("its ICC profile has other primaries");
        }
    }
    tone_contradiction(tag(profile, b"rTRC"))
}

/// Compares the curve at code 1/2. A pure gamma of 2.2 differs from sRGB by 0.004 there, which is accepted.
fn tone_contradiction(curve: Option<&[u8]>) -> Option<&'static str> {
    let middle = curve.and_then(value_at_half);
    match middle {
        Some(value) if (value - super::srgb::to_linear(0.5)).abs() < 0.01 => None,
        Some(_) => Some("its ICC profile has another tone curve"),
        None => Some("its ICC profile has a tone curve of an unknown type"),
    }
}

/// The data of a tag.
fn tag<'a>(profile: &'a [u8], name: &[u8; 4]) -> Option<&'a [u8]> {
    let count = usize::try_from(u32_at(profile, 128)?).ok()?;
    let entries = profile.get(132..)?.chunks_exact(12).take(count);
    let entry = entries.into_iter().find(|entry| entry.starts_with(name))?;
    let start = usize::try_from(u32_at(entry, 4)?).ok()?;
    let length = usize::try_from(u32_at(entry, 8)?).ok()?;
    profile.get(start..start.checked_add(length)?)
}

fn xyz(data: &[u8]) -> Option<[f64; 3]> {
    data.starts_with(b"XYZ ").then_some(())?;
    Some([fixed_at(data, 8)?, fixed_at(data, 12)?, fixed_at(data, 16)?])
}

/// The linear value of code 1/2 under a `curv` or `para` tag.
fn value_at_half(data: &[u8]) -> Option<f64> {
    let power = |base: f64, gamma: f64| crate::math::elementary::pow(base.max(0.0), gamma);
    match data.get(..4)? {
        b"curv" => match u32_at(data, 8)? {
            0 => Some(0.5),
            1 => Some(power(0.5, f64::from(u16_at(data, 12)?) / 256.0)),
            count => {
                let last = usize::try_from(count).ok()? - 1;
                let (low, high) = (u16_at(data, 12 + last / 2 * 2)?, u16_at(data, 12 + last.div_ceil(2) * 2)?);
                Some((f64::from(low) + f64::from(high)) / 2.0 / 65535.0)
            }
        },
        b"para" => {
            let gamma = fixed_at(data, 12)?;
            match u16_at(data, 8)? {
                0 => Some(power(0.5, gamma)),
                kind @ 1..=4 => {
                    let (a, b) = (fixed_at(data, 16)?, fixed_at(data, 20)?);
                    let offset = match kind {
                        2 => fixed_at(data, 24)?,
                        4 => fixed_at(data, 32)?,
                        _ => 0.0,
                    };
                    Some(power(a * 0.5 + b, gamma) + offset)
                }
                _ => None,
            }
        }
        _ => None,
    }
}

fn u16_at(data: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(*data.get(at..)?.first_chunk()?))
}

fn u32_at(data: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_be_bytes(*data.get(at..)?.first_chunk()?))
}

/// An `s15Fixed16Number`.
fn fixed_at(data: &[u8], at: usize) -> Option<f64> {
    Some(f64::from(i32::from_be_bytes(*data.get(at..)?.first_chunk()?)) / 65536.0)
}

/// sRGB's primaries adapted to D50, the white of the connection space (from the `sRGB IEC61966-2.1` profile).
const SRGB_RED: [f64; 3] = [0.4360, 0.2225, 0.0139];
const SRGB_GREEN: [f64; 3] = [0.3851, 0.7169, 0.0971];
const SRGB_BLUE: [f64; 3] = [0.1431, 0.0606, 0.7141];

#[cfg(test)]
mod tests {
    use super::*;

    /// A minimal matrix profile with one tone curve.
    fn profile(colorants: [[f64; 3]; 3], curve: &[u8]) -> Vec<u8> {
        let fixed = |x: &f64| u32::try_from(crate::math::cell(x * 65536.0 + 0.5, usize::MAX)).unwrap();
        let mut tags: Vec<(&[u8; 4], Vec<u8>)> = Vec::new();
        for (name, colorant) in [b"rXYZ", b"gXYZ", b"bXYZ"].into_iter().zip(&colorants) {
            let numbers = colorant.iter().flat_map(|x| fixed(x).to_be_bytes());
            tags.push((name, b"XYZ \0\0\0\0".iter().copied().chain(numbers).collect()));
        }
        tags.push((b"rTRC", curve.to_vec()));
        let mut bytes = vec![0; 128];
        bytes[16..20].copy_from_slice(b"RGB ");
        bytes.extend(4u32.to_be_bytes());
        let mut start = 132 + 12 * 4;
        for (name, data) in &tags {
            bytes.extend(name.iter());
            bytes.extend(u32::try_from(start).unwrap().to_be_bytes());
            bytes.extend(u32::try_from(data.len()).unwrap().to_be_bytes());
            start += data.len();
        }
        bytes.extend(tags.into_iter().flat_map(|(_, data)| data));
        bytes
    }

    const GAMMA_22: &[u8] = b"curv\0\0\0\0\0\0\0\x01\x02\x33";
    const LINEAR: &[u8] = b"curv\0\0\0\0\0\0\0\0";

    #[test]
    fn srgb_is_accepted_and_other_profiles_are_described() {
        let srgb = [SRGB_RED, SRGB_GREEN, SRGB_BLUE];
        // Display P3 to D50.
        let p3 = [[0.5151, 0.2412, 0.0], [0.2919, 0.6922, 0.0419], [0.1572, 0.0666, 0.7841]];
        assert_eq!(contradiction(&profile(srgb, GAMMA_22)), None);
        assert_eq!(contradiction(&profile(srgb, LINEAR)), Some("its ICC profile has another tone curve"));
        assert_eq!(contradiction(&profile(p3, GAMMA_22)), Some("its ICC profile has other primaries"));
        assert_eq!(contradiction(b""), Some("its ICC profile is broken"));
    }

    #[test]
    fn truncated_profiles_never_panic() {
        let whole = profile([SRGB_RED, SRGB_GREEN, SRGB_BLUE], GAMMA_22);
        for length in 0..whole.len() {
            let _ = contradiction(&whole[..length]);
        }
    }
}

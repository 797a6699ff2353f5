//! The headers of JPEGs.

/// Whether a decoder of this JPEG keeps the coefficients of the whole image. It decodes row by row if the frame is
/// sequential and its first scan has all components. Headers that end early count as those of an image that is kept.
pub(crate) fn keeps_coefficients(file: &[u8]) -> bool {
    let (mut rest, mut components) = (file.get(2..).unwrap_or_default(), None);
    loop {
        // Decoders skip what is between segments, and fill bytes.
        let marker = rest.windows(2).position(|pair| pair[0] == 0xff && !matches!(pair[1], 0 | 0xff));
        let Some(marker) = marker.map(|start| start + 1) else { return true };
        let segment = &rest[marker + 1..];
        match rest[marker] {
            // The header of a progressive frame.
            0xc2 | 0xc6 | 0xca | 0xce => return true,
            // That of a sequential frame: its length, bits, height, width, and number of components.
            0xc0 | 0xc1 => components = segment.get(7),
            // A scan: its length, and number of components.
            0xda => return components.is_none() || segment.get(2) != components,
            _ => {}
        }

        let length = segment.first_chunk().map_or(0, |length| usize::from(u16::from_be_bytes(*length)));
        rest = segment.get(length..).unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use image::{ExtendedColorType, ImageEncoder};

    use super::keeps_coefficients;

    fn position(file: &[u8], marker: u8) -> usize {
        file.windows(2).position(|pair| pair == [0xff, marker]).expect("a marker")
    }

    #[test]
    fn one_sequential_scan_of_all_components_keeps_nothing() {
        let mut file = Vec::new();
        let encoder = image::codecs::jpeg::JpegEncoder::new(&mut file);
        encoder.write_image(&[7; 600 * 3], 30, 20, ExtendedColorType::Rgb8).expect("a picture");
        assert!(!keeps_coefficients(&file));
        let (frame, scan) = (position(&file, 0xc0), position(&file, 0xda));
        let changed = |at: usize, byte: u8| {
            let mut file = file.clone();
            file[at] = byte;
            keeps_coefficients(&file)
        };
        assert!(!changed(frame + 1, 0xc1));
        assert!([0xc2, 0xc6, 0xca, 0xce].into_iter().all(|marker| changed(frame + 1, marker)));
        // The components of a scan, and of the frame.
        assert!(changed(scan + 4, 1) && changed(frame + 9, 4));
        for end in 0..scan + 5 {
            assert!(keeps_coefficients(&file[..end]), "{end}");
        }
        let progressive = [&file[..frame + 1], &[0xc2], &file[frame + 2..]].concat();
        // What decoders skip in front of a marker, and segments that only look like one.
        for skipped in [&[0xff; 9][..], &[0], &[0xff, 0], &[7, 0xff, 0xff, 0, 0xff], &[0xff, 0xfe, 0, 4, 0xff, 0xda]] {
            for (file, keeps) in [(&file, false), (&progressive, true)] {
                let skipping = [&file[..frame], skipped, &file[frame..]].concat();
                assert_eq!(keeps_coefficients(&skipping), keeps, "{skipped:?}");
            }
        }
    }
}

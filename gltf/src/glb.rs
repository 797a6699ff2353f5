//! The container of a `.glb`.

use std::ops::Range;

use crate::error::Problem;
use crate::warnings::Warnings;

/// Where the JSON of a file is, and its binary chunk.
pub(crate) struct Chunks {
    pub(crate) json: Range<usize>,
    pub(crate) binary: Option<Range<usize>>,
}

/// The chunks of a `.glb`. The whole file is the JSON of a `.gltf`, without the byte order mark that it must not have.
///
/// # Errors
/// If the header is that of another version, or the JSON is not in the file.
pub(crate) fn split(bytes: &[u8], warnings: &mut Warnings) -> Result<Chunks, Problem> {
    if !bytes.starts_with(b"glTF") {
        return Ok(Chunks { json: without_mark(bytes, 0..bytes.len(), warnings)?, binary: None });
    }
    let word = |at: usize| {
        let bytes = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(u32::from_le_bytes(bytes) as usize)
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(Problem::malformed("its header is cut off"));
    };
    if version != 2 {
        return Err(Problem::Version { found: format!("a binary header of version {version}") });
    }
    if length != bytes.len() {
        warnings.add(format!("the header says {length} bytes, and the file has {}", bytes.len()));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (word(at), bytes.get(at.saturating_add(4)..at.saturating_add(8))) {
        let start = at + 8;
        let end = start.saturating_add(length);
        let is_json = kind == b"JSON";
        if end > bytes.len() && (is_json || kind == b"BIN\0") {
            let chunk = if is_json { "JSON" } else { "binary" };
            let problem =
                format!("its {chunk} chunk has {length} bytes, and the file ends after {}", bytes.len() - start);
            if is_json {
                return Err(Problem::malformed(problem));
            }
            warnings.add(problem);
        }
        let chunk = start..end.min(bytes.len());
        match (is_json, kind) {
            (true, _) if json.is_none() => json = Some(chunk),
            (_, b"BIN\0") if json.is_some() && binary.is_none() => binary = Some(chunk),
            _ => {
                warnings.add("a chunk of the .glb is of another type than JSON and BIN, or there twice, and is ignored")
            }
        }
        // Chunks end at multiples of 4.
        let Some(next) = end.checked_next_multiple_of(4) else { break };
        at = next;
    }
    let json = json.ok_or_else(|| Problem::malformed("it has no JSON chunk"))?;
    Ok(Chunks { json: without_mark(bytes, json, warnings)?, binary })
}

fn without_mark(bytes: &[u8], json: Range<usize>, warnings: &mut Warnings) -> Result<Range<usize>, Problem> {
    let text = &bytes[json.clone()];
    if text.starts_with(&[0xff, 0xfe]) || text.starts_with(&[0xfe, 0xff]) {
        return Err(Problem::malformed("its JSON is UTF-16, as its byte order mark says, and must be UTF-8"));
    }
    if text.starts_with(&[0xef, 0xbb, 0xbf]) {
        warnings.add("the byte order mark before the JSON, which glTF forbids, is ignored");
        return Ok(json.start + 3..json.end);
    }
    Ok(json)
}

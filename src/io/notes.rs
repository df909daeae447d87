//! Notes for the reader of a mesh file, which programs ignore: lines `code: text`, as of warnings.
//!
//! All is done character by character, as searching in strings would be most of what this adds to a module.

use crate::volume::Space;

/// Returns the space that a header or comment of a mesh file states in the way of 3D Slicer, if it does.
pub(super) fn stated_space(text: &[u8]) -> Option<Space> {
    let says = |mark: &[u8]| text.windows(mark.len()).any(|part| part == mark);
    if says(b"SPACE=RAS") {
        return Some(Space::Ras);
    }
    says(b"SPACE=LPS").then_some(Space::Lps)
}

/// Returns a comment for each note, between `start` and `end`: in ASCII, which is all that some readers accept there,
/// without control characters, and without two hyphens in a row, which would end one of XML.
pub(super) fn comments(notes: &str, start: &str, end: &str) -> String {
    let mut out = String::new();
    let mut is_start = true;
    for c in notes.chars() {
        if is_start {
            out.push_str(start);
        }
        is_start = c == '\n';
        if is_start {
            out.push_str(end);
            continue;
        }
        let c = ascii(c);
        if c == '-' && out.ends_with('-') {
            out.push(' ');
        }
        out.push(c);
    }
    if !is_start {
        out.push_str(end);
    }
    out
}

/// Returns the codes of the notes for a header of `length` bytes, as many as fit, that of a surface that was moved with
/// its numbers in parentheses; empty without notes.
pub(super) fn short(notes: &str, length: usize) -> String {
    let mut out = String::new();
    let mut part = String::from(", warnings: ");
    let mut is_code = true;
    for c in notes.chars() {
        if c == ':' && is_code && out.len() + part.len() <= length {
            out.push_str(&part);
        }
        is_code = c == '\n' || is_code && c != ':';
        if c == '\n' || c == '(' {
            part.clear();
        }
        if c == '(' {
            part.push(' ');
        }
        part.push(ascii(c));
        if c == ')' && out.ends_with("recentred") && out.len() + part.len() <= length {
            out.push_str(&part);
        }
    }
    out
}

/// Returns the notes as a member of a JSON object, preceded by a comma: an array of strings in `extras.warnings`; empty
/// without notes.
pub(super) fn extras(notes: &str) -> String {
    let mut out = String::new();
    if notes.is_empty() {
        return out;
    }
    out.push_str(r#","extras":{"warnings":[""#);
    for c in notes.chars() {
        match c {
            '\n' => out.push_str(r#"",""#),
            '"' | '\\' => out.extend(['\\', c]),
            _ if c.is_control() => out.push(' '),
            _ => out.push(c),
        }
    }
    out.push_str(r#""]}"#);
    out
}

/// Returns the nearest character in ASCII for those that warnings have, a space for control characters.
fn ascii(c: char) -> char {
    match c {
        '×' => 'x',
        'µ' | 'μ' => 'u',
        '²' => '2',
        '³' => '3',
        '−' | '–' | '—' => '-',
        '‘' | '’' => '\'',
        '“' | '”' => '"',
        _ if c.is_control() => ' ',
        _ if c.is_ascii() => c,
        _ => '?',
    }
}

#[cfg(test)]
mod tests {
    use crate::io::{AnimationWriter, MeshFormat, WriteOptions, parse_mesh, write_mesh, write_mesh_with};
    use crate::math::Vec3;
    use crate::mesh::{Mesh, TriangleMesh};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn ball() -> TriangleMesh {
        Mesh::icosphere(Vec3::ZERO, 1.0, 0.8).unwrap().to_triangles()
    }

    fn write_noted(mesh: &TriangleMesh, format: MeshFormat, notes: &str) -> Vec<u8> {
        write_mesh_with(mesh, format, &WriteOptions { notes, ..WriteOptions::default() }).unwrap()
    }

    const NOTES: &str = "anisotropic: 1×1×6 mm³;\t the \"shape\" -- is\\a guess\nends-in-frame: Frame 3.";

    fn contains(bytes: &[u8], text: &str) -> bool {
        bytes.windows(text.len()).any(|part| part == text.as_bytes())
    }

    #[test]
    fn files_with_notes_are_read_as_without_them() {
        let mesh = ball();
        for format in [MeshFormat::Glb, MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Obj] {
            let [plain, noted] = ["", NOTES].map(|notes| write_noted(&mesh, format, notes));
            assert_eq!(plain, write_mesh(&mesh, format).unwrap());
            assert_ne!(plain, noted);
            assert_eq!(parse_mesh(&noted).unwrap(), parse_mesh(&plain).unwrap(), "{format:?}");
        }
    }

    #[test]
    fn notes_are_comments_in_ascii() {
        let mesh = ball();
        let text = r#"warning anisotropic: 1x1x6 mm3;  the "shape" - - is\a guess"#;
        let [ply, obj, vtp, mz3] = [MeshFormat::Ply, MeshFormat::Obj, MeshFormat::Vtp, MeshFormat::Mz3]
            .map(|format| write_noted(&mesh, format, NOTES));
        assert!(contains(&ply, &format!("\ncomment {text}\n")));
        assert!(contains(&obj, &format!("# {text}\n# warning ends-in-frame")));
        assert!(contains(&vtp, &format!("<!-- {} -->\n", text)));
        assert!(ply.iter().take(300).all(u8::is_ascii));
        assert_eq!(mz3, write_mesh(&mesh, MeshFormat::Mz3).unwrap());
    }

    #[test]
    fn the_header_of_an_stl_has_as_many_codes_as_fit() {
        let many = [NOTES; 5].join("\n");
        let stl = write_noted(&ball(), MeshFormat::Stl, &many);
        let header = "binary STL, warnings: anisotropic ends-in-frame anisotropic ends-in-frame ";
        assert!(stl.starts_with(header.as_bytes()), "{:?}", String::from_utf8_lossy(&stl[..80]));
        assert_eq!(stl[header.len()..80], b"      "[..80 - header.len()]);
    }

    #[test]
    fn the_header_of_an_stl_says_by_what_a_surface_was_moved() {
        let point = "(point 512345.625 5401234.5 123.5)";
        let notes = format!("recentred: Moved towards the origin. {point}\n{NOTES} (frame 3)");
        let stl = write_noted(&ball(), MeshFormat::Stl, &notes);
        let header = format!("binary STL, warnings: recentred {point} anisotropic ");
        assert!(stl.starts_with(header.as_bytes()), "{:?}", String::from_utf8_lossy(&stl[..80]));
    }

    #[test]
    fn a_glb_has_notes_in_the_extras_of_its_asset() {
        let mesh = ball();
        let mut animation = AnimationWriter::new(&WriteOptions { notes: NOTES, ..WriteOptions::default() });
        animation.add(&mesh).unwrap();
        let extras = r#""extras":{"warnings":["anisotropic: 1×1×6 mm³;  the \"shape\" -- is\\a guess","ends-in-frame: Frame 3."]}"#;
        for glb in [write_noted(&mesh, MeshFormat::Glb, NOTES), animation.finish(0.1).unwrap()] {
            assert!(contains(&glb, extras));
        }
    }
}

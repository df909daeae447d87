//! Notes for the reader of a mesh file, which programs ignore. Each is `code: text`, as of a warning.

/// Returns the notes as lines of a comment: in ASCII, which is all that some readers accept there, and without control
/// characters.
pub(super) fn comments(notes: &[String]) -> impl Iterator<Item = String> + '_ {
    notes.iter().map(|note| ascii(&format!("warning {note}")))
}

/// Returns the codes of the notes for a header of `length` bytes, as many as fit; empty without notes.
pub(super) fn short(notes: &[String], length: usize) -> String {
    let mut text = String::new();
    for note in notes {
        let code = ascii(note.split(':').next().unwrap_or_default());
        let next = if text.is_empty() { format!(", warnings: {code}") } else { format!(" {code}") };
        if text.len() + next.len() > length {
            break;
        }
        text += &next;
    }
    text
}

/// Returns a text in ASCII, with the nearest character for those that warnings have, and without control characters.
fn ascii(text: &str) -> String {
    text.chars()
        .map(|c| match c {
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
        })
        .collect()
}

/// Returns the notes as a member of a JSON object, preceded by a comma: an array of strings in `extras.warnings`; empty
/// without notes.
pub(super) fn extras(notes: &[String]) -> String {
    if notes.is_empty() {
        return String::new();
    }
    let entries: Vec<String> = notes.iter().map(|note| quoted(note)).collect();
    format!(r#","extras":{{"warnings":[{}]}}"#, entries.join(","))
}

/// Returns a text as a JSON string.
fn quoted(text: &str) -> String {
    let mut out = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            _ if c.is_control() => out.push(' '),
            _ => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use crate::io::{AnimationWriter, MeshFormat, parse_mesh, write_mesh, write_noted_mesh};
    use crate::math::Vec3;
    use crate::mesh::{Mesh, TriangleMesh};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn ball() -> TriangleMesh {
        Mesh::icosphere(Vec3::ZERO, 1.0, 0.8).unwrap().to_triangles()
    }

    fn notes() -> Vec<String> {
        ["anisotropic: 1×1×6 mm³;\n the \"shape\" -- is\\a guess", "ends-in-frame: Frame 3."]
            .map(String::from)
            .to_vec()
    }

    fn contains(bytes: &[u8], text: &str) -> bool {
        bytes.windows(text.len()).any(|part| part == text.as_bytes())
    }

    #[test]
    fn files_with_notes_are_read_as_without_them() {
        let mesh = ball();
        for format in [MeshFormat::Glb, MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Obj] {
            let [plain, noted] = [vec![], notes()].map(|n| write_noted_mesh(&mesh, format, &n).unwrap());
            assert_eq!(plain, write_mesh(&mesh, format).unwrap());
            assert_ne!(plain, noted);
            assert_eq!(parse_mesh(&noted).unwrap(), parse_mesh(&plain).unwrap(), "{format:?}");
        }
    }

    #[test]
    fn notes_are_comments_in_ascii() {
        let mesh = ball();
        let text = r#"warning anisotropic: 1x1x6 mm3;  the "shape" -- is\a guess"#;
        let [ply, obj, vtp, mz3] = [MeshFormat::Ply, MeshFormat::Obj, MeshFormat::Vtp, MeshFormat::Mz3]
            .map(|format| write_noted_mesh(&mesh, format, &notes()).unwrap());
        assert!(contains(&ply, &format!("\ncomment {text}\n")));
        assert!(contains(&obj, &format!("# {text}\n# warning ends-in-frame")));
        assert!(contains(&vtp, &format!("<!-- {} -->\n", text.replace("--", "- -"))));
        assert!(ply.iter().take(300).all(u8::is_ascii));
        assert_eq!(mz3, write_mesh(&mesh, MeshFormat::Mz3).unwrap());
    }

    #[test]
    fn the_header_of_an_stl_has_as_many_codes_as_fit() {
        let many: Vec<String> = notes().into_iter().cycle().take(9).collect();
        let stl = write_noted_mesh(&ball(), MeshFormat::Stl, &many).unwrap();
        let header = "binary STL, warnings: anisotropic ends-in-frame anisotropic ends-in-frame ";
        assert!(stl.starts_with(header.as_bytes()), "{:?}", String::from_utf8_lossy(&stl[..80]));
        assert_eq!(stl[header.len()..80], b"      "[..80 - header.len()]);
    }

    #[test]
    fn a_glb_has_notes_in_the_extras_of_its_asset() {
        let mesh = ball();
        let mut animation = AnimationWriter::default();
        animation.note(&notes());
        animation.add(&mesh).unwrap();
        let extras = r#""extras":{"warnings":["anisotropic: 1×1×6 mm³;  the \"shape\" -- is\\a guess","ends-in-frame: Frame 3."]}"#;
        for glb in
            [write_noted_mesh(&mesh, MeshFormat::Glb, &notes()).unwrap(), animation.finish(0.1).unwrap()]
        {
            assert!(contains(&glb, extras));
        }
    }
}

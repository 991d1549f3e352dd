//! Bytes to text, and files that only look like netlists.

use crate::diagnostic::{Diagnostic, Span};

/// The text of a file: a byte-order mark stripped, UTF-16 and Latin-1 converted, CRLF and CR turned into LF.
///
/// Bytes that are valid UTF-8 are UTF-8; what has a zero byte beside every ASCII character is UTF-16; anything else is
/// Latin-1 (the `µ` that LTspice writes as one byte).
#[must_use]
pub fn decode(bytes: &[u8]) -> String {
    let text = match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => utf8_or_latin1(rest),
        [0xFF, 0xFE, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [a, 0, b, 0, ..] if *a != 0 && *b != 0 => utf16(bytes, u16::from_le_bytes),
        [0, a, 0, b, ..] if *a != 0 && *b != 0 => utf16(bytes, u16::from_be_bytes),
        _ => utf8_or_latin1(bytes),
    };
    if text.contains('\r') {
        text.replace("\r\n", "\n").replace('\r', "\n")
    } else {
        text
    }
}

fn utf8_or_latin1(bytes: &[u8]) -> String {
    std::str::from_utf8(bytes).map_or_else(
        |_| bytes.iter().map(|&b| char::from(b)).collect(),
        str::to_string,
    )
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units)
        .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
        .collect()
}

/// If a text is a file of another program, what it is and what to do.
pub(super) fn foreign(text: &str, span: Span) -> Option<Diagnostic> {
    let start = text.trim_start();
    let head: String = start.chars().take(200).collect::<String>().to_lowercase();
    let (what, help) = if start.is_empty() {
        return Some(
            Diagnostic::error("empty", None, "the file is empty")
                .help("a netlist has a title line and cards"),
        );
    } else if head.starts_with("(export") {
        (
            "a KiCad PCB netlist",
            "export a SPICE netlist from KiCad's schematic editor instead",
        )
    } else if head.starts_with("(kicad_") {
        (
            "a KiCad file",
            "export a SPICE netlist from KiCad's schematic editor",
        )
    } else if head.starts_with("[main]") && head.contains("filetype=cir") {
        (
            "a Micro-Cap schematic",
            "export a SPICE netlist from Micro-Cap",
        )
    } else if head.starts_with("\"expresspcb") {
        (
            "an ExpressPCB netlist",
            "save a SPICE netlist (`.net`) instead",
        )
    } else if head.starts_with("<?xml")
        || head.starts_with("<!doctype")
        || head.starts_with("<html")
    {
        ("an XML or HTML file", "give the SPICE netlist itself")
    } else if head.starts_with("version 4") && head.contains("sheet") {
        (
            "an LTspice schematic",
            "in LTspice choose View > SPICE Netlist and save it",
        )
    } else if (head.starts_with("title:") && start.contains("\nPlotname:"))
        || head.starts_with("time,")
    {
        (
            "a file of waveforms",
            "`circ view FILE` shows it; to simulate, give the netlist",
        )
    } else if start.contains('\0') {
        ("a binary file", "give a SPICE netlist, which is text")
    } else {
        return None;
    };
    let message = format!("this is {what}, not a SPICE netlist");
    Some(
        Diagnostic::error("not-a-netlist", span, message)
            .label("the file begins like this")
            .help(help),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodings() {
        assert_eq!(decode(b"\xEF\xBB\xBFa\r\nb\rc\n"), "a\nb\nc\n");
        assert_eq!(decode(b"R1 1 0 10\xB5"), "R1 1 0 10µ");
        assert_eq!(decode("R1 1 0 10µ".as_bytes()), "R1 1 0 10µ");
        let utf16: Vec<u8> = "V1 1 0 5µ\n"
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect();
        assert_eq!(decode(&utf16), "V1 1 0 5µ\n");
        let marked: Vec<u8> = [0xFE, 0xFF]
            .into_iter()
            .chain("x\n".encode_utf16().flat_map(u16::to_be_bytes))
            .collect();
        assert_eq!(decode(&marked), "x\n");
    }
}

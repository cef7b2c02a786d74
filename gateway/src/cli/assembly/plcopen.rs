//! Types and function block as PLCopen XML (TC6, version 2.01).

use std::fmt::Write as _;

use super::library::{Block, Library, Member, escaped};
use super::structured_text;

/// The file.
pub fn file(library: &Library<'_>) -> String {
    let name = escaped(&library.prefix);
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
         <project xmlns=\"http://www.plcopen.org/xml/tc6_0201\" xmlns:xhtml=\"http://www.w3.org/1999/xhtml\">\n  \
         <fileHeader companyName=\"Axisbridge\" productName=\"axisbridge assembly\" productVersion=\"{}\" \
         creationDateTime=\"{}\"/>\n  \
         <contentHeader name=\"{name}\">\n    <Comment>{}</Comment>\n    <coordinateInfo>\n",
        env!("CARGO_PKG_VERSION"),
        // The same configuration gives the same file.
        "2026-11-28T00:00:00",
        escaped(&library.about().join("\n")),
    );
    for language in ["fbd", "ld", "sfc"] {
        let _ = writeln!(text, "      <{language}><scaling x=\"1\" y=\"1\"/></{language}>");
    }
    text.push_str("    </coordinateInfo>\n  </contentHeader>\n  <types>\n    <dataTypes>\n");
    for structure in library.types() {
        let _ = writeln!(
            text,
            "      <dataType name=\"{}\">\n        <baseType>\n          <struct>",
            structure.name
        );
        declare(&mut text, "            ", &structure.members);
        let _ = writeln!(text, "          </struct>\n        </baseType>");
        let _ = writeln!(text, "        {}\n      </dataType>", documentation(&structure.about));
    }
    text.push_str("    </dataTypes>\n    <pous>\n");
    if let Some(block) = library.block() {
        function_block(&mut text, &block);
    }
    text.push_str(
        "    </pous>\n  </types>\n  <instances>\n    <configurations/>\n  </instances>\n</project>\n",
    );
    text
}

fn function_block(text: &mut String, block: &Block) {
    let _ =
        writeln!(text, "      <pou name=\"{}\" pouType=\"functionBlock\">\n        <interface>", block.name);
    let data = [("ToAxis", &block.output), ("FromAxis", &block.input)].map(|(name, kind)| Member {
        name: name.to_owned(),
        kind: kind.clone(),
        about: String::new(),
    });
    for (section, members) in [
        ("inputVars", block.inputs()),
        ("inOutVars", data.into()),
        ("outputVars", block.outputs()),
        ("localVars", block.locals()),
    ] {
        let _ = writeln!(text, "          <{section}>");
        declare(text, "            ", &members);
        let _ = writeln!(text, "          </{section}>");
    }
    let _ = writeln!(text, "          {}", documentation(&block.about().join("\n")));
    let _ = writeln!(
        text,
        "        </interface>\n        <body>\n          <ST><xhtml:p>{}</xhtml:p></ST>\n        </body>\n      </pou>",
        escaped(&structured_text::statements(block))
    );
}

fn declare(text: &mut String, indent: &str, members: &[Member]) {
    for Member { name, kind, about } in members {
        let kind = match kind.chars().all(|letter| letter.is_ascii_uppercase()) {
            true => format!("<{kind}/>"),
            false => format!("<derived name=\"{kind}\"/>"),
        };
        let about = if about.is_empty() { String::new() } else { documentation(about) };
        let _ = writeln!(text, "{indent}<variable name=\"{name}\"><type>{kind}</type>{about}</variable>");
    }
}

fn documentation(about: &str) -> String {
    format!("<documentation><xhtml:p>{}</xhtml:p></documentation>", escaped(about))
}

//! Types and an instruction as an L5X file, the form in which Logix Designer imports components.

use std::fmt::Write as _;

use super::library::{Block, Dialect, Library, Member, Structure};
use super::{CliError, Field};

/// Structured Text of that tool: bits by number, no unsigned types, values of 64 bits by COP only.
const DIALECT: Dialect = Dialect {
    bit: |word, bit| format!("{word}.{bit}"),
    copy_long: |to, from| format!("COP({from}, {to}, 1);"),
};

/// The file.
///
/// # Errors
/// The tool would lay the fields out with gaps.
pub fn file(library: &Library<'_>) -> Result<String, CliError> {
    for (side, fields) in [("output", library.output()), ("input", library.input())] {
        check_alignment(side, fields, library.axes.len())?;
    }
    let block = library.block();
    let types = library.types();
    let (target, kind) = match &block {
        Some(block) => (block.name.as_str(), "AddOnInstructionDefinition"),
        None => (types[2].name.as_str(), "DataType"),
    };
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?>\n\
         <RSLogix5000Content SchemaRevision=\"1.0\" SoftwareRevision=\"20.01\" TargetName=\"{target}\" TargetType=\"{kind}\" \
         ContainsContext=\"true\" Owner=\"Axisbridge\">\n<!--\n{}\n-->\n\
         <Controller Use=\"Context\" Name=\"Axisbridge\">\n<DataTypes Use=\"Context\">\n",
        library.about().join("\n").replace("--", "- -")
    );
    for structure in &types {
        data_type(&mut text, structure, if structure.name == target { "Target" } else { "Context" });
    }
    text.push_str("</DataTypes>\n<Modules Use=\"Context\"/>\n");
    text.push_str("<AddOnInstructionDefinitions Use=\"Context\">\n");
    if let Some(block) = &block {
        instruction(&mut text, block);
    }
    text.push_str(
        "</AddOnInstructionDefinitions>\n<Tags Use=\"Context\"/>\n<Programs Use=\"Context\"/>\n</Controller>\n</RSLogix5000Content>\n",
    );
    Ok(text)
}

/// The tool aligns each member to its size, and a structure to its largest member, at least to four bytes. What it adds to the last
/// axis is beyond the data.
fn check_alignment(side: &str, fields: &[Field<'_>], axes: usize) -> Result<(), CliError> {
    if let Some(field) = fields.iter().find(|field| field.offset % field.bytes != 0) {
        return Err(format!(
            "the {side} field `{}` of {} bytes is at offset {}: in L5X a field has to be at a multiple of its size; add a `pad` field before it",
            field.name, field.bytes, field.offset
        )
        .into());
    }
    let len: usize = fields.iter().map(|field| field.bytes).sum();
    let unit = fields.iter().map(|field| field.bytes).max().unwrap_or(1).max(4);
    match len % unit {
        _ if axes == 1 => Ok(()),
        0 => Ok(()),
        rest => Err(format!(
            "the {side} fields of an axis have {len} bytes: in L5X they have to be a multiple of {unit}; add {} bytes of `pad` fields at the end",
            unit - rest
        )
        .into()),
    }
}

/// The type of the tool for a type of IEC 61131-3.
fn kind(of: &str) -> &str {
    match of {
        "USINT" | "BYTE" => "SINT",
        "UINT" => "INT",
        "UDINT" => "DINT",
        other => other,
    }
}

fn radix(of: &str) -> &'static str {
    if of.contains('_') { "NullType" } else { "Decimal" }
}

fn data_type(text: &mut String, structure: &Structure, of_use: &str) {
    let Structure { name, about, members } = structure;
    let _ = writeln!(text, "<DataType Use=\"{of_use}\" Name=\"{name}\" Family=\"NoFamily\" Class=\"User\">");
    let _ = writeln!(text, "{}<Members>", description(about));
    for Member { name, kind: of, about } in members {
        let _ = writeln!(
            text,
            "<Member Name=\"{name}\" DataType=\"{}\" Dimension=\"0\" Radix=\"{}\" Hidden=\"false\" \
             ExternalAccess=\"Read/Write\">{}</Member>",
            kind(of),
            radix(of),
            description(about)
        );
    }
    text.push_str("</Members>\n</DataType>\n");
}

fn instruction(text: &mut String, block: &Block) {
    let _ = writeln!(
        text,
        "<AddOnInstructionDefinition Use=\"Target\" Name=\"{}\" Revision=\"1.0\" Vendor=\"Axisbridge\" ExecutePrescan=\"false\" \
         ExecutePostscan=\"false\" ExecuteEnableInFalse=\"false\">",
        block.name
    );
    let _ = writeln!(text, "{}<Parameters>", description(&block.about().join("\n")));
    for (name, usage) in [("EnableIn", "Input"), ("EnableOut", "Output")] {
        let _ = writeln!(
            text,
            "<Parameter Name=\"{name}\" TagType=\"Base\" DataType=\"BOOL\" Usage=\"{usage}\" Radix=\"Decimal\" Required=\"false\" \
             Visible=\"false\" ExternalAccess=\"Read Only\"/>"
        );
    }
    for (name, of) in [("ToAxis", &block.output), ("FromAxis", &block.input)] {
        parameter(text, name, of, "InOut", "");
    }
    for Member { name, kind, about } in block.inputs() {
        // Only references can have 64 bits.
        let usage = if kind == "LINT" { "InOut" } else { "Input" };
        parameter(text, &name, &kind, usage, &about);
    }
    for Member { name, kind, about } in block.outputs() {
        parameter(text, &name, &kind, "Output", &about);
    }
    text.push_str("</Parameters>\n<LocalTags>\n");
    for Member { name, kind: of, about } in block.locals() {
        let _ = writeln!(
            text,
            "<LocalTag Name=\"{name}\" DataType=\"{}\" Radix=\"Decimal\" ExternalAccess=\"None\">{}</LocalTag>",
            kind(&of),
            description(&about)
        );
    }
    text.push_str("</LocalTags>\n<Routines>\n<Routine Name=\"Logic\" Type=\"ST\">\n<STContent>\n");
    let body = block.body(&DIALECT) + "ToAxis.control := ControlWord;\n";
    for (number, line) in body.lines().enumerate() {
        let _ = writeln!(text, "<Line Number=\"{number}\"><![CDATA[{line}]]></Line>");
    }
    text.push_str("</STContent>\n</Routine>\n</Routines>\n</AddOnInstructionDefinition>\n");
}

fn parameter(text: &mut String, name: &str, of: &str, usage: &str, about: &str) {
    let access = match usage {
        "InOut" => "Constant=\"false\"",
        "Output" => "ExternalAccess=\"Read Only\"",
        _ => "ExternalAccess=\"Read/Write\"",
    };
    let required = usage == "InOut";
    let _ = writeln!(
        text,
        "<Parameter Name=\"{name}\" TagType=\"Base\" DataType=\"{}\" Usage=\"{usage}\" Radix=\"{}\" Required=\"{required}\" \
         Visible=\"true\" {access}>{}</Parameter>",
        kind(of),
        radix(of),
        description(about)
    );
}

fn description(about: &str) -> String {
    if about.is_empty() {
        return String::new();
    }
    format!("<Description><![CDATA[{}]]></Description>", about.replace("]]>", "]] >"))
}

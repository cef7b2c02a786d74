//! Types and function block in Structured Text (IEC 61131-3).

use std::fmt::Write as _;

use super::library::{Block, Dialect, Library, Member};

/// The language as the standard has it.
pub const DIALECT: Dialect = Dialect {
    bit: |word, bit| format!("((UINT_TO_WORD({word}) AND WORD#16#{:04X}) <> WORD#16#0000)", 1_u32 << bit),
    copy_long: |to, from| format!("{to} := {from};"),
};

/// The file.
pub fn file(library: &Library<'_>) -> String {
    let mut text = String::from("(*\n");
    for line in library.about() {
        let _ = writeln!(text, "  {line}");
    }
    text.push_str("*)\n");
    for structure in library.types() {
        let _ = writeln!(text, "\n(* {}. *)", structure.about);
        // Tools that know the word place the members without gaps; the others read over it.
        let _ = writeln!(text, "{{attribute 'pack_mode' := '1'}}");
        let _ = writeln!(text, "TYPE {} :\nSTRUCT", structure.name);
        declare(&mut text, &structure.members);
        text.push_str("END_STRUCT\nEND_TYPE\n");
    }
    if let Some(block) = library.block() {
        text.push('\n');
        function_block(&mut text, &block);
    }
    text
}

fn function_block(text: &mut String, block: &Block) {
    text.push_str("(*\n");
    for line in block.about() {
        let _ = writeln!(text, "  {line}");
    }
    let _ = writeln!(text, "*)\nFUNCTION_BLOCK {}", block.name);
    let data = [
        Member {
            name: "ToAxis".to_owned(),
            kind: block.output.clone(),
            about: "The axis in the output assembly.".to_owned(),
        },
        Member {
            name: "FromAxis".to_owned(),
            kind: block.input.clone(),
            about: "The axis in the input assembly.".to_owned(),
        },
    ];
    for (section, members) in [
        ("VAR_INPUT", block.inputs()),
        ("VAR_IN_OUT", data.into()),
        ("VAR_OUTPUT", block.outputs()),
        ("VAR", block.locals()),
    ] {
        let _ = writeln!(text, "{section}");
        declare(text, &members);
        text.push_str("END_VAR\n");
    }
    text.push('\n');
    text.push_str(&statements(block));
    text.push_str("END_FUNCTION_BLOCK\n");
}

/// The statements of the block.
pub fn statements(block: &Block) -> String {
    block.body(&DIALECT) + "ToAxis.control := DINT_TO_UINT(ControlWord);\n"
}

fn declare(text: &mut String, members: &[Member]) {
    for Member { name, kind, about } in members {
        let _ = writeln!(text, "    {name} : {kind}; (* {about} *)");
    }
}

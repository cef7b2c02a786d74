#!/usr/bin/env python3
"""Mutates the engine and the profiles, and asks `axisbridge snapshot tests/frames` whether it notices.

    tests/mutants/run.py SCRATCH [--report FILE] [--jobs N] [--limit N] [--built]

The sources are copied to SCRATCH, and every mutant is put into the copy behind a number that is read once from the environment
(`AXISBRIDGE_MUTANT`), so that one build has all of them. Mutants that do not compile are taken out again. Then each mutant is
asked about by the lists and scenes that reach it, the quickest first, until one notices. It needs Python 3 and cargo, no other package; it is no part of `cargo test`.

What is changed is decided by file and form of a line, never by hand:

    delete     a statement of one line that assigns or calls is left out
    negate     the condition of an `if` or of a guard, or a comparison that is given a name or returned, is negated
    operand    the right operand of +, - or * is the default of its type (zero)

A mutant is "noticed" when the snapshot ends with another status or text than without it, or does not end. One that is not is
"not reached" when no frame runs the line, else it "survives".
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]

# The command and the feedback path, by file.
FILES = [
    "gateway/src/engine/axis/**/*.rs",
    "gateway/src/engine/device/**/*.rs",
    "gateway/src/engine/local/**/*.rs",
    "mappings/src/attributes.rs",
    "mappings/src/cip_scaling.rs",
    "mappings/src/compile_cip.rs",
    "mappings/src/sercos/compile.rs",
    "mappings/src/device_link.rs",
    "mappings/src/drive_program.rs",
    "mappings/src/sercos/scaling.rs",
    "profile-generic/src/program/**/*.rs",
    "profile-generic/src/scaling.rs",
    "profile-generic/src/ratio.rs",
    "profile-generic/src/interpolation/**/*.rs",
    "profile-sercos/src/master/connection.rs",
    "profile-sercos/src/wire/connection.rs",
    "profile-cip/src/device/axis/**/*.rs",
    "profile-cip/src/device/motion/receive.rs",
]

SWITCH = """
//! Which mutant is in force.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

static ACTIVE: OnceLock<u32> = OnceLock::new();
static TRACED: OnceLock<bool> = OnceLock::new();
static SEEN: [AtomicBool; 8192] = [const { AtomicBool::new(false) }; 8192];

/// Whether a mutant is in force; with `AXISBRIDGE_MUTANTS_TRACED` set it is told when its line runs for the first time.
pub fn on(number: u32) -> bool {
    let traced = *TRACED.get_or_init(|| std::env::var_os("AXISBRIDGE_MUTANTS_TRACED").is_some());
    if traced && !SEEN[number as usize].swap(true, Ordering::Relaxed) {
        eprintln!("mutant {number} runs");
    }
    let read = || std::env::var("AXISBRIDGE_MUTANT").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    *ACTIVE.get_or_init(read) == number
}

/// The value, or the default of its type.
pub fn operand<T: Default>(number: u32, value: T) -> T {
    if on(number) { T::default() } else { value }
}
"""

CALL = re.compile(r"^\s+(?:self|\*?[a-z_][\w.]*)(?:\.[\w.\[\]()*&, ]+)?(?: [-+|&]?= [^;{}]*|\([^;{}]*\)|\.[\w]+\([^;{}]*\));$")
IF = re.compile(r"^(\s*(?:\} else )?if )((?!let\b)[^{]*[^{ ]) \{$")
GUARD = re.compile(r"^(\s+[^/\"]*\S if )((?!let\b)[^=]*(?:[=!<>]=?[^=>][^=]*)?) (=>.*)$")
NAMED = re.compile(r"^(\s+let \w+ = )([^;|{}]*(?: == | != | < | > | <= | >= | && )[^;|{}]*);$")
OPERAND = re.compile(r"(?<=[\w)\]] )([-+*]) ((?:self\.|i128::from\()?[a-z_][\w.]*(?:\(\))?\)?)(?=[;,)]| [-+*/] )")


TESTS = re.compile(r"#\[cfg\(test\)\]\n(?:#\[.*\]\n)*mod \w+ \{")


def source_lines(text):
    """The lines of a file before its tests, each with whether it may be changed."""
    tests = TESTS.search(text)
    end = tests.start() if tests else len(text)
    return text[:end].split("\n"), text[end:]


def mutants_of(lines, name):
    """(line, operator, new line with @N@ for the number) of every mutant."""
    found = []
    depth_const = False
    for at, line in enumerate(lines):
        bare = line.strip()
        if bare.startswith(("//", "#", "use ", "pub use ", "mod ", "const ", "static ", "pub const ", "debug_assert")):
            continue
        if '"' in line or "'" in line and "'_" not in line and not re.search(r"'[a-z]\b", line):
            continue
        before = lines[at - 1].strip() if at else ""
        starts = before.endswith((";", "{", "}")) or before == "" or before.startswith("//")
        match = IF.match(line)
        if match and "let " not in match[2] and starts:
            found.append((at, "negate", f"{match[1]}{name}::on(@N@) ^ ({match[2]}) {{"))
        match = GUARD.match(line)
        if match and "let " not in match[2]:
            found.append((at, "negate", f"{match[1]}{name}::on(@N@) ^ ({match[2]}) {match[3]}"))
        match = NAMED.match(line)
        if match and "?" not in match[2]:
            found.append((at, "negate", f"{match[1]}{name}::on(@N@) ^ ({match[2]});"))
        if starts and CALL.match(line) and not bare.startswith(("return", "let ", "break", "continue")):
            found.append((at, "delete", f"if !{name}::on(@N@) {{ {line.strip()} }}"))
        for match in OPERAND.finditer(line):
            if "=>" in line[match.start():] or "impl" in line or "dyn" in line:
                continue
            escaped = line[: match.start()]
            tail = line[match.end():]
            operand = match[2]
            # An unbalanced bracket belongs to what is around.
            extra = ""
            while operand.count(")") > operand.count("("):
                operand, extra = operand[:-1], ")" + extra
            if operand.count("(") != operand.count(")"):
                continue
            found.append((at, "operand", f"{escaped}{match[1]} {name}::operand(@N@, {operand}){extra}{tail}"))
    return found


def copy_sources(scratch):
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True).stdout.decode()
    for name in filter(None, names.split("\0")):
        to = scratch / "src" / name
        if not (ROOT / name).is_file():
            continue
        to.parent.mkdir(parents=True, exist_ok=True)
        data = (ROOT / name).read_bytes()
        if not to.exists() or to.read_bytes() != data:
            to.write_bytes(data)


def plan():
    """Every mutant: file, line, operator, text."""
    mutants = []
    for pattern in FILES:
        if not any(ROOT.glob(pattern)):
            sys.exit(f"no file is {pattern} any more")
    paths = sorted({path for pattern in FILES for path in ROOT.glob(pattern)})
    for path in paths:
        if path.name == "tests.rs" or "tests" in path.relative_to(ROOT).parts:
            continue
        name = path.relative_to(ROOT).as_posix()
        switch = "crate::mutants" if name.startswith("profile-generic/") else "profile_generic::mutants"
        lines, _ = source_lines(path.read_text())
        for at, kind, text in mutants_of(lines, switch):
            mutants.append({"file": name, "line": at + 1, "kind": kind, "text": text, "was": lines[at].strip()})
    for number, mutant in enumerate(mutants, 1):
        mutant["number"] = number
    return mutants


def write(scratch, mutants, files):
    """The copy with these mutants; at most one on a line."""
    by_file = {}
    for mutant in mutants:
        by_file.setdefault(mutant["file"], {}).setdefault(mutant["line"], mutant)
    for name in files | {"profile-generic/src/lib.rs"}:
        lines, rest = source_lines((ROOT / name).read_text())
        for line, mutant in by_file.get(name, {}).items():
            lines[line - 1] = mutant["text"].replace("@N@", str(mutant["number"]))
        text = "\n".join(lines) + rest
        if name == "profile-generic/src/lib.rs":
            text += "\n#[allow(missing_docs)]\npub mod mutants;\n"
        to = scratch / "src" / name
        if to.read_text() != text:
            to.write_text(text)
    (scratch / "src/profile-generic/src/mutants.rs").write_text(SWITCH)
    return [mutant for lines in by_file.values() for mutant in lines.values()]


def cargo(scratch, *arguments):
    environment = dict(os.environ, CARGO_TARGET_DIR=str(scratch / "target"), CARGO_PROFILE_DEV_DEBUG="0", RUSTFLAGS="--cap-lints allow")
    return subprocess.run(
        ["cargo", *arguments, "-p", "axisbridge", "--bin", "axisbridge", "--message-format", "json"],
        cwd=scratch / "src", env=environment, capture_output=True, text=True,
    )


def build(scratch, mutants):
    """Takes out what does not compile, and builds the rest."""
    files = {mutant["file"] for mutant in mutants}
    for attempt in range(40):
        there = write(scratch, mutants, files)
        result = cargo(scratch, "check")
        if result.returncode == 0:
            break
        wrong = set()
        for line in result.stdout.splitlines():
            message = json.loads(line)
            if message.get("reason") != "compiler-message" or message["message"]["level"] != "error":
                continue
            for span in message["message"]["spans"] + [s for c in message["message"]["children"] for s in c["spans"]]:
                for line in range(span["line_start"], span["line_end"] + 1):
                    wrong.add((span["file_name"], line))
        places = {(mutant["file"], mutant["line"]) for mutant in there}
        if not wrong & places:
            sys.exit("does not compile, and no mutant is to blame:\n" + result.stdout[-4000:] + result.stderr[-4000:])
        mutants = [m for m in mutants if (m["file"], m["line"]) not in wrong]
        print(f"attempt {attempt + 1}: {len(wrong & places)} do not compile", file=sys.stderr)
    there = write(scratch, mutants, files)
    result = cargo(scratch, "build")
    if result.returncode != 0:
        sys.exit(result.stderr[-4000:])
    return there


def units(scratch):
    """A folder for the lists of each folder, and for each scene: what a mutant does not reach is not asked about it."""
    found = []
    frames = ROOT / "tests/frames"
    for config in sorted(frames.rglob("config.toml")):
        scenes = [path for path in sorted(config.parent.glob("*.toml")) if path != config]
        # Lists share a bench, and what one of them shows may depend on those before it.
        lists = sorted(config.parent.glob("*.hex"))
        for parts in [lists, *[[scene] for scene in scenes]]:
            if not parts:
                continue
            name = parts[0].stem if len(parts) == 1 else "lists"
            unit = scratch / "units" / "-".join([*config.parent.relative_to(frames).parts, name])
            unit.mkdir(parents=True, exist_ok=True)
            (unit / "config.toml").write_bytes(config.read_bytes())
            for path in parts:
                for ending in [path.suffix, ".events", ".local", ".golden"]:
                    if path.with_suffix(ending).exists():
                        (unit / path.name).with_suffix(ending).write_bytes(path.with_suffix(ending).read_bytes())
            found.append(unit)
    return found


def snapshot(scratch, unit, number, traced=False, accept=False):
    environment = dict(os.environ, AXISBRIDGE_MUTANT=str(number), RUST_BACKTRACE="0")
    if traced:
        environment["AXISBRIDGE_MUTANTS_TRACED"] = "1"
    command = [str(scratch / "target/debug/axisbridge"), "snapshot", str(unit), *(["--accept"] if accept else [])]
    try:
        return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=30)
    except subprocess.TimeoutExpired:
        return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scratch", type=pathlib.Path)
    parser.add_argument("--report", type=pathlib.Path)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--limit", type=int, help="this many mutants of each file at most, evenly spread")
    parser.add_argument("--built", action="store_true", help="use the program and the mutants of the last run")
    arguments = parser.parse_args()
    scratch = arguments.scratch.resolve()
    scratch.mkdir(parents=True, exist_ok=True)
    kept_plan = scratch / "mutants.json"
    if arguments.built:
        mutants = json.loads(kept_plan.read_text())
    else:
        copy_sources(scratch)
        mutants = build(scratch, plan())
        kept_plan.write_text(json.dumps(mutants))
    if arguments.limit:
        kept = []
        for name in dict.fromkeys(mutant["file"] for mutant in mutants):
            own = [mutant for mutant in mutants if mutant["file"] == name]
            step = max(1, -(-len(own) // arguments.limit))
            kept += own[::step]
        mutants = kept
    began = time.monotonic()
    # Which mutants each list and each scene reaches; the quickest are asked first.
    reached = {}
    for unit in units(scratch):
        start = time.monotonic()
        right = snapshot(scratch, unit, 0, traced=True)
        if right is None:
            sys.exit(f"{unit}: no end without a mutant")
        if right.returncode != 0:
            # The sources were changed since: what the program without a mutant makes of it is what counts.
            print(f"{unit.name}: the golden text is not that of the program", file=sys.stderr)
            snapshot(scratch, unit, 0, accept=True)
        runs = {int(number) for number in re.findall(r"mutant (\d+) runs", right.stderr)}
        reached[unit] = (time.monotonic() - start, runs)
    order = sorted(reached, key=lambda unit: reached[unit][0])

    def judge(mutant):
        asked = [unit for unit in order if mutant["number"] in reached[unit][1]]
        for unit in asked:
            result = snapshot(scratch, unit, mutant["number"])
            if result is None or result.returncode != 0:
                return "noticed", unit.name
        return ("survives" if asked else "not reached"), None

    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool, (scratch / "verdicts").open("w") as verdicts:
        for mutant, (verdict, unit) in zip(mutants, pool.map(judge, mutants)):
            mutant["verdict"] = verdict
            print(verdict, unit or "", f"{mutant['file']}:{mutant['line']}", mutant["kind"], mutant["was"], sep="\t", file=verdicts, flush=True)
    text = report(mutants, time.monotonic() - began)
    if arguments.report:
        arguments.report.write_text(text)
    else:
        print(text)


def report(mutants, seconds):
    verdicts = ["noticed", "survives", "not reached"]
    count = lambda own: [sum(m["verdict"] == verdict for m in own) for verdict in verdicts]
    out = [f"{len(mutants)} mutants in {seconds:.0f} s.", "", "| file | mutants | noticed | survive | not reached |", "|---|---|---|---|---|"]
    for name in sorted({mutant["file"] for mutant in mutants}):
        own = [mutant for mutant in mutants if mutant["file"] == name]
        noticed, survive, unreached = count(own)
        out.append(f"| `{name}` | {len(own)} | {noticed} | {survive} | {unreached} |")
    noticed, survive, unreached = count(mutants)
    out.append(f"| all | {len(mutants)} | {noticed} | {survive} | {unreached} |")
    for verdict in verdicts[1:]:
        out += ["", f"## {verdict.capitalize()}", ""]
        for mutant in mutants:
            if mutant["verdict"] == verdict:
                was = mutant["was"].replace("`", "")
                out.append(f"- `{mutant['file']}:{mutant['line']}` {mutant['kind']}: `{was}`")
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    main()

//! Findings in SARIF 2.1.0, for hosts of repositories that show them at their lines.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::registry::Code;
use super::{Finding, Findings};

const SCHEMA: &str = "https://json.schemastore.org/sarif-2.1.0.json";

/// One run with all findings and the rules that they break.
#[must_use]
pub fn report(findings: &Findings) -> Value {
    let codes: BTreeSet<Code> = findings.list().iter().map(|finding| finding.code).collect();
    let codes: Vec<Code> = codes.into_iter().collect();
    let results = findings.list().iter().map(|finding| result(finding, &codes));
    json!({
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": {
                "name": "axisbridge check",
                "version": env!("CARGO_PKG_VERSION"),
                "semanticVersion": env!("CARGO_PKG_VERSION"),
                "rules": codes.iter().map(|code| rule(*code)).collect::<Vec<_>>(),
            } },
            "columnKind": "unicodeCodePoints",
            "results": results.collect::<Vec<_>>(),
        }],
    })
}

fn rule(code: Code) -> Value {
    let entry = code.entry();
    json!({
        "id": code.to_string(),
        "shortDescription": { "text": entry.title },
        "fullDescription": { "text": entry.explanation },
        "help": { "text": entry.remedy },
        "defaultConfiguration": { "level": entry.severity.name() },
    })
}

fn result(finding: &Finding, codes: &[Code]) -> Value {
    let parts = [&finding.title, &finding.expected, &finding.help];
    let text: Vec<&str> = parts.iter().map(|part| part.as_str()).filter(|part| !part.is_empty()).collect();
    let mut result = json!({
        "ruleId": finding.code.to_string(),
        "ruleIndex": codes.iter().position(|code| *code == finding.code),
        "level": finding.severity().name(),
        "message": { "text": text.join(": ") },
        "locations": [location(&finding.file, finding.line, finding.column, finding.length)],
    });
    if let (Some(related), Value::Object(result)) = (&finding.related, &mut result) {
        let mut place = location(&related.file, related.line, related.column, 0);
        place["message"] = json!({ "text": related.text });
        result.insert("relatedLocations".to_owned(), json!([place]));
    }
    result
}

fn location(file: &str, line: usize, column: usize, length: usize) -> Value {
    // A path is a URI reference: what may not stand in one is escaped.
    let uri: String = file.bytes().map(escaped).collect();
    let mut place = json!({ "artifactLocation": { "uri": uri } });
    if line > 0 {
        let mut region = json!({ "startLine": line, "startColumn": column });
        if length > 0 {
            region["endColumn"] = json!(column + length);
        }
        place["region"] = region;
    }
    json!({ "physicalLocation": place })
}

fn escaped(byte: u8) -> String {
    match byte {
        b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => {
            char::from(byte).to_string()
        }
        b'\\' => "/".to_owned(),
        _ => format!("%{byte:02X}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finding::{Problem, Source, registry};

    /// The keys that SARIF 2.1.0 requires (3.13, 3.14, 3.18, 3.27, 3.28, 3.30), and the place as a code host reads it.
    #[test]
    fn has_the_required_keys_and_the_place() {
        let mut findings = Findings::default();
        let source = Source::new("my tables/line 4.toml", "one\n\u{b5} = 5\n");
        findings.push(&source, Problem::new(registry::UNKNOWN_KEY, 4..6).key("\u{b5}").expected("a name"));
        findings.push_file(registry::UNREADABLE, std::path::Path::new("none.toml"), "expected a file");
        let report = report(&findings);
        assert_eq!((&report["version"], &report["$schema"]), (&"2.1.0".into(), &SCHEMA.into()));
        let run = &report["runs"][0];
        assert_eq!(run["tool"]["driver"]["name"], "axisbridge check");
        assert_eq!(run["tool"]["driver"]["rules"].as_array().map(Vec::len), Some(2));
        let results = run["results"].as_array().unwrap();
        assert_eq!(results.len(), 2);
        for result in results {
            assert!(result["message"]["text"].as_str().is_some_and(|text| !text.is_empty()));
            let index = usize::try_from(result["ruleIndex"].as_u64().unwrap()).unwrap();
            assert_eq!(run["tool"]["driver"]["rules"][index]["id"], result["ruleId"]);
            assert_eq!(result["level"], "error");
        }
        let place = &results[0]["locations"][0]["physicalLocation"];
        assert_eq!(place["artifactLocation"]["uri"], "my%20tables/line%204.toml");
        assert_eq!(place["region"], json!({ "startLine": 2, "startColumn": 1, "endColumn": 2 }));
        assert!(results[1]["locations"][0]["physicalLocation"].get("region").is_none());
    }
}

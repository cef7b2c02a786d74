//! The result of a comparison for programs: JSON, and JUnit for the test reports of code hosts.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use super::case::{Case, Status};
use crate::mapping::check::escaped;

/// Version of the JSON object. It counts up when a field changes its meaning or goes away.
const SCHEMA: u32 = 1;

impl Status {
    const fn name(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Differs => "differs",
            Self::New => "new",
            Self::Orphaned => "orphaned",
        }
    }
}

/// The JSON object.
pub fn json(cases: &[Case]) -> Value {
    let files: Vec<Value> = cases
        .iter()
        .map(|case| {
            let facts =
                case.facts.iter().map(|fact| json!({"rows": fact.rows, "now": fact.now, "was": fact.was}));
            json!({
                "file": case.file.display().to_string(),
                "status": case.status.name(),
                "fine": case.is_fine(),
                "refused": case.refused,
                "translated": case.counts.translated,
                "passed_over": case.counts.passed_over,
                "failed": case.counts.failed,
                "diff": case.diff,
                "facts": facts.collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({"schema": SCHEMA, "fine": cases.iter().all(Case::is_fine), "files": files})
}

/// The same as JUnit has it.
pub fn junit(folder: &Path, cases: &[Case]) -> String {
    let failures = cases.iter().filter(|case| !case.is_fine()).count();
    let name = escaped(&folder.display().to_string());
    let (tests, mut out) = (cases.len(), String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"));
    // Writing to a string does not fail.
    let _ = writeln!(
        out,
        "<testsuites tests=\"{tests}\" failures=\"{failures}\">\n  <testsuite name=\"axisbridge snapshot {name}\" \
         tests=\"{tests}\" failures=\"{failures}\">"
    );
    for case in cases {
        let file = escaped(&case.file.display().to_string());
        let _ =
            write!(out, "    <testcase classname=\"axisbridge.snapshot\" name=\"{file}\" file=\"{file}\"");
        if case.is_fine() {
            out += "/>\n";
            continue;
        }
        let mut text = String::new();
        let _ = case.write(&mut text);
        let _ = writeln!(
            out,
            ">\n      <failure message=\"{}\">{}</failure>\n    </testcase>",
            escaped(&case.message()),
            escaped(&text)
        );
    }
    out + "  </testsuite>\n</testsuites>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::translate::Counts;

    #[test]
    fn both_reports_have_a_case_for_each_file() {
        let counts = Counts { translated: 3, passed_over: 1, failed: 0 };
        let new = Case::new(Path::new("a<b.hex"), "text".to_owned(), None, counts);
        let cases = [new, Case::orphan(Path::new("old.golden"))];
        let expected = r#"<?xml version="1.0" encoding="UTF-8"?>
<testsuites tests="2" failures="2">
  <testsuite name="axisbridge snapshot frames" tests="2" failures="2">
    <testcase classname="axisbridge.snapshot" name="a&lt;b.hex" file="a&lt;b.hex">
      <failure message="a&lt;b.hex: no a&lt;b.golden yet">a&lt;b.hex: no a&lt;b.golden yet
</failure>
    </testcase>
    <testcase classname="axisbridge.snapshot" name="old.golden" file="old.golden">
      <failure message="old.golden: it has no frames any more">old.golden: it has no frames any more
</failure>
    </testcase>
  </testsuite>
</testsuites>
"#;
        assert_eq!(junit(Path::new("frames"), &cases), expected);
        let found = json(&cases);
        assert_eq!((&found["schema"], &found["fine"]), (&json!(1), &json!(false)));
        assert_eq!(
            (&found["files"][0]["status"], &found["files"][0]["translated"]),
            (&json!("new"), &json!(3))
        );
        assert_eq!(found["files"][1]["status"], json!("orphaned"));
    }
}

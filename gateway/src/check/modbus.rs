//! Registers that are parameters of drives: whether an overlay defines the parameters, and lets them be written.

use profile_generic::parameter::Access;

use crate::config::Written;
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Spanned, closest};
use crate::mapping::Mapping;

/// Looks at each binding of a configuration.
pub(super) fn check(mapping: &Mapping, written: &Written, findings: &mut Findings) {
    let rows = written.file.modbus.iter().flat_map(|table| &table.parameter).map(Spanned::get_ref);
    let generic = &mapping.dictionaries.generic;
    let own = || generic.parameters().iter().filter(|row| row.parameter.is_of_vendor());
    for row in rows {
        let name = &row.parameter;
        let Some(known) = own().find(|known| known.name == *name.get_ref()) else {
            let title = format!("no overlay defines the parameter `{}`", name.get_ref());
            let problem = Problem::new(code::CONFIG_REFERENCE, name.span()).title(title);
            let problem = problem.expected("expected the name of a [[generic.parameter]] of an overlay");
            let near = closest(name.get_ref(), own().map(|known| known.name.as_str()));
            let help = near.map(|near| format!("did you mean `{near}`?")).unwrap_or_default();
            findings.push(&written.text, problem.help(help));
            continue;
        };
        if row.write && known.access == Access::Read {
            let title = format!("`{}` can only be read", known.name);
            let problem = Problem::new(code::CONFIG_VALUE, name.span()).title(title);
            findings.push(&written.text, problem.expected("expected a register without `write`"));
        }
    }
}

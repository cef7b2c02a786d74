//! What a request for a parameter of a drive takes: accesses one after the other, and the reply.
//!
//! | request | accesses |
//! |---|---|
//! | read | the value; of an IDN also name, unit, minimum and maximum |
//! | write | the value as it is, the new value, the value again; the unit of an IDN |
//! | list | of a SERCOS drive its list of IDNs; of others none |

use std::fmt::{self, Write as _};

use profile_sercos::wire::attribute::Attribute;
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc::Element;

use super::job::{Ask, Context, Listing, ParameterReport, RECOMMISSION, Step, error, is_over, read, room};
use crate::config::KnownObject;
use crate::engine::direct::{DirectAnswer, DirectFailure, Direction, Target};
use crate::local::protocol::parameter_lines;
use crate::mapping::{Access, Cia402Access};
use crate::parameter::attributes::KnownAttribute;
use crate::parameter::command;
use crate::parameter::id::Id;
use crate::parameter::known::{Bus, belongs_to_gateway, rescales};
use crate::parameter::value::{Kind, hex};

/// Longest name, unit or limit that is shown, bytes.
pub(super) const ELEMENT_MAX: usize = 1_024;

/// What the drive was asked last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asked {
    Value,
    Element(Element),
    Before,
    Write,
    Back,
    List,
}

/// A request for parameters on its way through its accesses.
#[derive(Debug)]
pub struct ParameterJob {
    ask: Ask,
    asked: Asked,
    attribute: Option<Attribute>,
    report: ParameterReport,
    wanted: Vec<u8>,
}

impl ParameterJob {
    /// Begins with a request: the job and its first access.
    ///
    /// # Errors
    /// The reply, if the drive need not be asked.
    pub fn begin(ask: Ask, context: &Context<'_>) -> Result<(Self, Step), String> {
        let id = ask.id();
        let (asked, step) = match (&ask, context.bus) {
            (Ask::Read { id, .. }, _) => (Asked::Value, read(id.target())),
            (Ask::Write { id, .. }, _) => {
                if let Some(why) = belongs_to_gateway(*id) {
                    return Err(error(&ask, context, "gateway", &format!("{id} is not written: {why}")));
                }
                (Asked::Before, read(id.target()))
            }
            (Ask::List { of }, Bus::Sercos) => (Asked::List, read(Id::Idn(list_idn(*of)).target())),
            (Ask::List { of }, _) => return Err(list_without_drive(*of, context)),
            // A job of its own.
            (Ask::Command { .. }, _) => return Err(String::new()),
        };
        let report = ParameterReport {
            id: id.map(|id| id.to_string()).unwrap_or_default(),
            ..ParameterReport::default()
        };
        Ok((Self { ask, asked, attribute: None, report, wanted: Vec::new() }, step))
    }

    /// The parameter that is written, if it is that.
    pub(super) const fn written(&self) -> Option<Id> {
        match self.ask {
            Ask::Write { id, .. } => Some(id),
            _ => None,
        }
    }

    /// Takes the answer of the drive.
    pub fn take(&mut self, answer: DirectAnswer, context: &Context<'_>) -> Step {
        let DirectAnswer { result, data, .. } = answer;
        let attribute = match result {
            Ok(attribute) => attribute,
            Err(failure) => {
                return match self.asked {
                    // A drive need not have these.
                    Asked::Element(element) if !is_over(&failure) => self.after(element, context),
                    _ => Step::Reply(self.failed(&failure, context)),
                };
            }
        };
        match self.asked {
            Asked::Value => {
                self.take_value(attribute, &data, context);
                match &self.ask {
                    Ask::Read { id: Id::Idn(_), .. } => self.ask_element(Element::Name, context),
                    _ => self.report(context),
                }
            }
            Asked::Element(element) => {
                let text = match element {
                    Element::Minimum | Element::Maximum => self.limit_kind().decode(&data),
                    _ => Kind::Sercos(TEXT).decode(&data),
                };
                let place = match element {
                    Element::Name => &mut self.report.name,
                    Element::Unit => &mut self.report.unit,
                    Element::Minimum => &mut self.report.minimum,
                    _ => &mut self.report.maximum,
                };
                *place = Some(text).filter(|text| !text.is_empty()).or(place.take());
                self.after(element, context)
            }
            Asked::Before => self.write(attribute, &data, context),
            Asked::Write => {
                self.asked = Asked::Back;
                self.ask.id().map_or_else(|| self.report(context), |id| read(id.target()))
            }
            Asked::Back => {
                let before = std::mem::take(&mut self.report.value);
                self.take_value(attribute.or(self.attribute), &data, context);
                if data != self.wanted {
                    let wanted = self.kind(context).decode(&self.wanted);
                    let text = format!(
                        "the drive took {} = {wanted} and has {} afterwards{}",
                        self.report.id,
                        self.report.value,
                        self.recommission()
                    );
                    return Step::Reply(error(&self.ask, context, "not-kept", &text));
                }
                self.report.before = Some(before);
                self.report.recommission = self.ask.id().is_some_and(rescales);
                self.ask_element(Element::Unit, context)
            }
            Asked::List => {
                let ids = data
                    .chunks_exact(4)
                    .filter_map(|idn| Some(Idn(u32::from_le_bytes(idn.try_into().ok()?))));
                Step::Reply(list_of_drive(ids, self.listing(), context))
            }
        }
    }

    /// Writes the new value, once the old one is known.
    fn write(&mut self, attribute: Option<Attribute>, data: &[u8], context: &Context<'_>) -> Step {
        self.take_value(attribute, data, context);
        let Ask::Write { id, text } = &self.ask else { return self.report(context) };
        let fail = |code, text: &str| Step::Reply(error(&self.ask, context, code, text));
        if attribute.is_some_and(Attribute::is_command) {
            return fail("command", &format!("{id} is a procedure command: it is executed, not written"));
        }
        match self.kind(context).encode(text) {
            Ok(wanted) => {
                let direction = Direction::Write { rescales: rescales(*id) };
                let step = Step::Access(id.target(), direction, wanted.clone());
                self.asked = Asked::Write;
                self.wanted = wanted;
                step
            }
            Err(wrong) => fail("value", &wrong.to_string()),
        }
    }

    fn take_value(&mut self, attribute: Option<Attribute>, data: &[u8], context: &Context<'_>) {
        self.attribute = attribute;
        let kind = self.kind(context);
        let Self { ask, report, .. } = self;
        report.value = kind.decode(data);
        report.data = hex(data);
        report.kind = Some(kind.describe()).filter(|kind| !kind.is_empty());
        report.attribute = attribute.map(|attribute| format!("{:#010x}", attribute.0));
        report.writable = ask.id().and_then(|id| writable(id, attribute, context));
        match ask.id() {
            Some(Id::Idn(idn)) => {
                report.name =
                    report.name.take().or_else(|| context.catalogue.idn_name(idn).map(str::to_owned));
            }
            Some(Id::Object(object)) => {
                let known = context.bus.object(object);
                let some = |text: &String| Some(text.clone()).filter(|text| !text.is_empty());
                report.name = known.and_then(|known| some(&known.name));
                report.unit = known.and_then(|known| some(&known.unit));
                report.access = known.and_then(|known| known.access).map(|access| access.name().to_owned());
            }
            Some(id @ Id::Path { .. }) => {
                let Some(known) = context.bus.attribute(id) else { return };
                report.name = Some(known.name.clone());
                report.unit = Some(known.unit.clone()).filter(|unit| !unit.is_empty());
                report.access = Some(known.access.name().to_owned());
                [report.minimum, report.maximum] = known.limits.map(|limit| Some(limit?.to_string()));
            }
            None => {}
        }
    }

    /// Which list was asked for.
    fn listing(&self) -> Listing {
        match self.ask {
            Ask::List { of } => of,
            _ => Listing::All,
        }
    }

    /// What the bytes of the parameter are.
    fn kind(&self, context: &Context<'_>) -> Kind {
        match (self.attribute, self.ask.id()) {
            (Some(attribute), _) => Kind::Sercos(attribute),
            (None, Some(Id::Object(object))) => context
                .bus
                .object(object)
                .and_then(|known| known.data_type)
                .map_or(Kind::Unknown, Kind::Object),
            (None, Some(id @ Id::Path { .. })) => {
                context.bus.attribute(id).map_or(Kind::Unknown, |known| known.kind)
            }
            _ => Kind::Unknown,
        }
    }

    /// What minimum and maximum of the IDN are: those of a list are of one item.
    fn limit_kind(&self) -> Kind {
        const VARIABLE: u32 = 1 << 18;
        self.attribute.map_or(Kind::Unknown, |attribute| Kind::Sercos(Attribute(attribute.0 & !VARIABLE)))
    }

    fn ask_element(&mut self, element: Element, context: &Context<'_>) -> Step {
        let Some(Id::Idn(idn)) = self.ask.id() else { return self.report(context) };
        self.asked = Asked::Element(element);
        Step::Access(Target::Element(idn, element), Direction::Read, room(ELEMENT_MAX))
    }

    /// Goes on behind an element.
    fn after(&mut self, element: Element, context: &Context<'_>) -> Step {
        // After a write, the unit is all that is asked for.
        let brief = !matches!(self.ask, Ask::Read { brief: false, .. });
        let has_limits =
            self.attribute.is_some_and(|attribute| !attribute.is_command() && !attribute.is_list());
        match element {
            Element::Name if !brief => self.ask_element(Element::Unit, context),
            Element::Unit if has_limits && !brief => self.ask_element(Element::Minimum, context),
            Element::Minimum => self.ask_element(Element::Maximum, context),
            _ => self.report(context),
        }
    }

    /// The reply of success.
    fn report(&self, context: &Context<'_>) -> Step {
        // The object has texts only, and nothing that JSON does not know.
        let json = serde_json::to_string(&self.report).unwrap_or_default();
        Step::Reply(format!("ok {} {} {json}\n", self.ask.word(), context.axis))
    }

    /// What a failure has to add once a value was written.
    fn recommission(&self) -> &'static str {
        let is_written = !matches!(self.asked, Asked::Value | Asked::Before | Asked::List);
        match self.ask {
            Ask::Write { id, .. } if is_written && rescales(id) => RECOMMISSION,
            _ => "",
        }
    }

    /// The reply of a failure, and what was done before.
    fn failed(&self, failure: &DirectFailure, context: &Context<'_>) -> String {
        let what = match self.ask.id() {
            Some(id) => id.to_string(),
            None => list_idn(self.listing()).to_string(),
        };
        let mut text = match self.asked {
            Asked::Back => format!("{what}: written, and not read back: {failure}"),
            Asked::Write if failure.code() == "unanswered" && *failure != DirectFailure::NoDrive => {
                format!("{what}: it is not known whether the drive has taken the value: {failure}")
            }
            _ => format!("{what}: {failure}"),
        };
        if self.asked != Asked::Write || failure.may_have_written(self.wanted.len()) {
            text += self.recommission();
        }
        error(&self.ask, context, failure.code(), &text)
    }
}

/// When a parameter can be written while the gateway runs, as far as tables and drive say. All drives are in CP4 then.
fn writable(id: Id, attribute: Option<Attribute>, context: &Context<'_>) -> Option<String> {
    const YES: &str = "without torque";
    const NEVER: &str = "never";
    if let Some(why) = belongs_to_gateway(id) {
        return Some(format!("not through the gateway: {why}"));
    }
    let text = match id {
        Id::Idn(_) => {
            let attribute = attribute?;
            let phases = [2, 3].map(|phase| !attribute.write_protected(phase));
            match (attribute.write_protected(4), phases) {
                _ if attribute.is_command() => "not: it is a procedure command",
                (false, _) => YES,
                (true, [true, true]) => "in CP2 and CP3 only",
                (true, [true, false]) => "in CP2 only",
                (true, [false, true]) => "in CP3 only",
                (true, [false, false]) => NEVER,
            }
        }
        Id::Object(object) => match context.bus.object(object)?.access? {
            Cia402Access::Rw | Cia402Access::Wo => YES,
            _ => NEVER,
        },
        Id::Path { .. } => match context.bus.attribute(id)?.access {
            Access::Set => YES,
            // The connection writes it.
            Access::Get | Access::SetCyclic => NEVER,
        },
    };
    Some(text.to_owned())
}

/// Name and unit of an IDN.
pub(super) const TEXT: Attribute = Attribute::new(
    profile_sercos::wire::attribute::ItemLength::One,
    profile_sercos::wire::attribute::Format::Text,
)
.list();

/// The list of a SERCOS drive.
const fn list_idn(of: Listing) -> Idn {
    match of {
        Listing::All => Idn::IDN_LIST_OF_ALL_OPERATION_DATA,
        Listing::Backup => Idn::IDN_LIST_OF_ALL_BACKUP_OPERATION_DATA,
        Listing::Commands => Idn::IDN_LIST_OF_ALL_PROCEDURE_COMMANDS,
    }
}

/// What the gateway itself adds to a list: parameters with names of their own.
fn named(of: Listing, context: &Context<'_>) -> String {
    if of == Listing::All { parameter_lines(context.parameters) } else { String::new() }
}

/// The reply to `list` from a list of IDNs.
fn list_of_drive(idns: impl Iterator<Item = Idn>, of: Listing, context: &Context<'_>) -> String {
    let mut text = named(of, context);
    let mut count = text.lines().count();
    for idn in idns {
        count += 1;
        let _ = match context.catalogue.idn_name(idn) {
            Some(name) => writeln!(text, "parameter {idn} name={name}"),
            None => writeln!(text, "parameter {idn}"),
        };
    }
    let _ = writeln!(text, "{}", end_of_list(count, &list_idn(of).to_string(), context));
    text
}

/// The reply to `list` from what is known without the drive.
fn list_without_drive(of: Listing, context: &Context<'_>) -> String {
    let mut text = named(of, context);
    let mut count = text.lines().count();
    let (source, rows) = match context.bus {
        Bus::Can { source, objects } => (*source, objects_of(of, objects)),
        Bus::Devicenet { attributes } => ("dictionary", attributes_of(of, attributes)),
        // It has lists of its own.
        Bus::Sercos => ("", Vec::new()),
    };
    for row in rows {
        count += 1;
        text += &row;
    }
    let _ = writeln!(text, "{}", end_of_list(count, source, context));
    text
}

/// The lines of a CANopen drive.
fn objects_of(of: Listing, objects: &[KnownObject]) -> Vec<String> {
    let is_listed = |known: &&KnownObject| match of {
        Listing::All => true,
        Listing::Backup => known.is_kept(),
        Listing::Commands => command::signature(known.object).is_some(),
    };
    let line = |known: &KnownObject| {
        let access = known.access.map_or("", |access| access.name());
        let kind = known.data_type.map_or("", |kind| kind.name());
        line(&known.object, [access, kind, &known.unit], &known.name)
    };
    objects.iter().filter(is_listed).map(line).collect()
}

/// The lines of a drive on DeviceNet, which has no procedure commands.
fn attributes_of(of: Listing, attributes: &[KnownAttribute]) -> Vec<String> {
    let is_listed = |known: &&KnownAttribute| match of {
        Listing::All => true,
        Listing::Backup => known.is_kept,
        Listing::Commands => false,
    };
    let line = |known: &KnownAttribute| {
        line(&known.id, [known.access.name(), &known.kind.describe(), &known.unit], &known.name)
    };
    attributes.iter().filter(is_listed).map(line).collect()
}

/// The line of a parameter: access, type and unit, as far as they are known, and its name.
fn line(id: &dyn fmt::Display, details: [&str; 3], name: &str) -> String {
    let mut text = format!("parameter {id}");
    for (key, value) in ["access", "type", "unit"].into_iter().zip(details) {
        // A value is one word.
        if !value.is_empty() && !value.contains(' ') {
            let _ = write!(text, " {key}={value}");
        }
    }
    // A name is from a file: it ends with the line whatever is in it.
    let name: String = name.chars().filter(|letter| !letter.is_control()).collect();
    let _ = match name.is_empty() {
        true => writeln!(text),
        false => writeln!(text, " name={name}"),
    };
    text
}

fn end_of_list(count: usize, source: &str, context: &Context<'_>) -> String {
    format!("ok list {} {count} bus={} source={source}", context.axis, context.bus.name())
}

#[cfg(test)]
mod tests {
    use profile_sercos::master::svc::request::SvcFailure;
    use profile_sercos::wire::attribute::{Format, ItemLength};
    use profile_sercos::wire::svc_error::SvcError;

    use super::*;
    use crate::local::drive::job::Job;
    use crate::local::protocol::NamedParameter;
    use crate::parameter::known::Catalogue;
    use profile_generic::parameter::{Access, Parameter};

    use crate::mapping::Mapping;

    /// An answer of the engine: the result and the buffer.
    type Said = (Result<Option<Attribute>, DirectFailure>, Vec<u8>);

    /// A job for a SERCOS drive, and what comes of these answers.
    fn steps(ask: Ask, answers: Vec<Said>) -> (Vec<Target>, String) {
        let catalogue = Catalogue::new(vec![Bus::Sercos], &Mapping::embedded().unwrap());
        let notch = NamedParameter {
            name: "notch".to_owned(),
            parameter: Parameter(Parameter::FIRST_OF_VENDOR),
            unit: "",
            access: Access::Read,
            range: None,
        };
        let context = Context { axis: "x", bus: &Bus::Sercos, catalogue: &catalogue, parameters: &[notch] };
        let mut targets = Vec::new();
        let (mut job, mut step) = match Job::begin(ask, &context) {
            Ok(begun) => begun,
            Err(reply) => return (targets, reply),
        };
        for (result, data) in answers {
            let Step::Access(target, ..) = step else { panic!("over before {data:?}") };
            targets.push(target);
            step = job.take(DirectAnswer { client: 1, id: 1, result, data }, &context);
        }
        match step {
            Step::Reply(reply) => (targets, reply),
            Step::Access(target, ..) => panic!("{target:?} is still asked for"),
        }
    }

    fn id() -> Id {
        Id::parse("S-0-0104").unwrap()
    }

    fn gain() -> Attribute {
        Attribute::new(ItemLength::Two, Format::Unsigned).with_decimals(2)
    }

    fn refused(element: Element, code: u16) -> Result<Option<Attribute>, DirectFailure> {
        Err(DirectFailure::Svc(SvcFailure::Refused { element, code: SvcError(code) }))
    }

    #[test]
    fn an_element_that_a_drive_does_not_have_is_left_out() {
        let answers = vec![
            (Ok(Some(gain())), vec![0x96, 0]),
            (refused(Element::Name, 0x2001), vec![]),
            (refused(Element::Unit, 0x4001), vec![]),
            (Ok(None), vec![1, 0]),
            (refused(Element::Maximum, 0x6001), vec![]),
        ];
        let (targets, reply) = steps(Ask::Read { id: id(), brief: false }, answers);
        let elements = [Element::Data, Element::Name, Element::Unit, Element::Minimum, Element::Maximum];
        assert_eq!(targets, elements.map(|element| Target::Element(Idn::standard(104), element)));
        let expected = "ok read x {\"id\":\"S-0-0104\",\"name\":\"Position loop K_V-factor\",\"type\":\"2 byte unsigned, 2 \
                        decimals\",\"minimum\":\"0.01\",\"attribute\":\"0x02110001\",\"writable\":\"without torque\",\"value\":\"1.50\",\"data\":\"9600\"}\n";
        assert_eq!(reply, expected, "the name of the tables");
        let answers = vec![(Ok(Some(gain())), vec![0x96, 0]), (Err(DirectFailure::Unanswered), vec![])];
        let (_, reply) = steps(Ask::Read { id: id(), brief: false }, answers);
        assert_eq!(reply, "error read x unanswered: S-0-0104: the drive does not answer\n");
    }

    #[test]
    fn how_far_a_write_has_come_is_said() {
        let write = || Ask::Write { id: id(), text: "2".to_owned() };
        let before = || (Ok(Some(gain())), vec![0x96, 0]);
        let gone = || (Err(DirectFailure::Unanswered), vec![]);
        for (answers, reply) in [
            (vec![gone()], "error write x unanswered: S-0-0104: the drive does not answer\n"),
            (
                vec![before(), gone()],
                "error write x unanswered: S-0-0104: it is not known whether the drive has taken the value: the drive does not \
                 answer\n",
            ),
            (
                vec![before(), (Err(DirectFailure::NoDrive), vec![])],
                "error write x unanswered: S-0-0104: the drive is not there, or is not commissioned yet\n",
            ),
            (
                vec![before(), (Ok(None), vec![]), gone()],
                "error write x unanswered: S-0-0104: written, and not read back: the drive does not answer\n",
            ),
            (
                vec![before(), (Ok(None), vec![]), (Ok(Some(gain())), vec![199, 0])],
                "error write x not-kept: the drive took S-0-0104 = 2.00 and has 1.99 afterwards\n",
            ),
        ] {
            assert_eq!(steps(write(), answers).1, reply);
        }
        let after = (Ok(Some(gain())), vec![200, 0]);
        let (targets, reply) =
            steps(write(), vec![before(), (Ok(None), vec![]), after, (Ok(None), b"A".to_vec())]);
        assert_eq!(targets.last(), Some(&Target::Element(Idn::standard(104), Element::Unit)));
        assert!(reply.contains("\"unit\":\"A\""), "{reply}");
        assert!(reply.contains("\"value\":\"2.00\",\"before\":\"1.50\",\"data\":\"c800\""), "{reply}");
    }

    #[test]
    fn failure_after_the_write_of_a_scaling_says_that_the_drive_has_to_be_commissioned_again() {
        let factor = Attribute::new(ItemLength::Two, Format::Unsigned);
        let before = || (Ok(Some(factor)), vec![1, 0]);
        let gone = || (Err(DirectFailure::Unanswered), vec![]);
        let again = "; the axis cannot be enabled before its drive was commissioned again";
        for (answers, text, changes) in [
            (vec![gone()], "unanswered: S-0-0077: the drive does not answer", false),
            (
                vec![before(), (refused(Element::Data, 0x7005), vec![5, 0])],
                "refused: S-0-0077: the drive refuses the operation data with 0x7005: operation data is write protected at this time",
                false,
            ),
            (
                vec![before(), gone()],
                "unanswered: S-0-0077: it is not known whether the drive has taken the value: the drive does not answer",
                true,
            ),
            (
                vec![before(), (Ok(None), vec![]), gone()],
                "unanswered: S-0-0077: written, and not read back: the drive does not answer",
                true,
            ),
            (
                vec![before(), (Ok(None), vec![]), before()],
                "not-kept: the drive took S-0-0077 = 5 and has 1 afterwards",
                true,
            ),
        ] {
            let ask = Ask::Write { id: Id::parse("S-0-0077").unwrap(), text: "5".to_owned() };
            let again = if changes { again } else { "" };
            assert_eq!(steps(ask, answers).1, format!("error write x {text}{again}\n"));
        }
    }

    #[test]
    fn a_list_of_a_drive_has_what_only_the_gateway_knows_ahead() {
        let list = [104, 0, 0, 0, 1, 0x80, 0, 0, 9, 9].to_vec();
        let (_, reply) = steps(Ask::List { of: Listing::All }, vec![(Ok(None), list)]);
        let expected = "parameter notch access=read\nparameter S-0-0104 name=Position loop K_V-factor\nparameter P-0-0001\n\
                        ok list x 3 bus=sercos source=S-0-0017\n";
        assert_eq!(reply, expected);
        let (_, reply) =
            steps(Ask::List { of: Listing::Backup }, vec![(refused(Element::Idn, 0x1001), vec![])]);
        assert_eq!(
            reply,
            "error list x absent: S-0-0192: the drive refuses the IDN with 0x1001: IDN not available\n"
        );
    }
}

//! The attribute services as a job that can pause: Get and Set of lists and single attributes.
//!
//! A job goes through its items one by one. An item that the drive has to answer leaves the job waiting; the answer
//! resumes it. The whole request is checked for its form before the first item is touched.

use core::cmp::Ordering;

use arrayvec::ArrayVec;

use crate::device::attribute::{AttributeTable, DataType};
use crate::wire::motion::attribute_list::{
    AttributeSelector, GetRequest, HEAD_LEN, ListWriter, SetRequest, SetStatus, take_value,
};
use crate::wire::status::GeneralStatus;
use crate::wire::{Error, Reader};

/// Most octets of a request or response body: 255 words of a service block less its header.
pub const BODY_MAX: usize = 4 * 254;

/// Octets of one status in the answer to a list of Sets.
const SET_STATUS_LEN: usize = 4;

/// Which service a job carries out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ListFormat {
    /// Get_Axis_Attributes_List, 0x4B.
    AxisGet,
    /// Set_Axis_Attributes_List, 0x4C.
    AxisSet,
    /// Get_Attribute_List, 0x03.
    CommonGet,
    /// Set_Attribute_List, 0x04.
    CommonSet,
    /// Get_Attribute_Single, 0x0E, of this attribute.
    SingleGet(u16),
    /// Set_Attribute_Single, 0x10, of this attribute.
    SingleSet(u16),
}

/// What an item asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Item {
    pub id: u16,
    /// `None` stands for the whole attribute.
    pub selector: Option<AttributeSelector>,
    /// Octets of the value in the request, if the item is a Set.
    pub value: Option<core::ops::Range<usize>>,
}

/// How an item ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome<'a> {
    /// The octets of a Get.
    Value(&'a [u8]),
    /// A Set was carried out.
    Done,
    /// A refusal and the array index that caused it.
    Refused(GeneralStatus, u16),
}

/// A service in progress.
#[derive(Debug, Clone)]
pub(crate) struct ListJob {
    format: ListFormat,
    request: ArrayVec<u8, BODY_MAX>,
    at: usize,
    left: u16,
    response: ArrayVec<u8, BODY_MAX>,
    count: u16,
    status: GeneralStatus,
}

impl ListJob {
    /// Checks the form of a request and starts its job. `limit` is the most octets of the response body: a list of Sets
    /// whose statuses will not fit is refused before the first value is written. `table` has the lengths of the values in a
    /// Set_Attribute_List.
    ///
    /// # Errors
    /// The request is malformed.
    // Flat: one arm per format of a list.
    pub fn new(
        format: ListFormat,
        body: &[u8],
        limit: usize,
        table: &AttributeTable,
    ) -> Result<Self, GeneralStatus> {
        let mut request = ArrayVec::new();
        request.try_extend_from_slice(body).map_err(|_| GeneralStatus::TOO_MUCH_DATA)?;
        let (at, left) = match format {
            ListFormat::AxisGet => {
                let list = GetRequest::new(body).map_err(|_| GeneralStatus::NOT_ENOUGH_DATA)?;
                let left = list.left();
                whole(list, GetRequest::rest)?;
                (HEAD_LEN, left)
            }
            ListFormat::AxisSet => {
                let list = SetRequest::new(body).map_err(|_| GeneralStatus::NOT_ENOUGH_DATA)?;
                let left = list.left();
                whole(list, SetRequest::rest)?;
                (HEAD_LEN, left)
            }
            ListFormat::CommonGet | ListFormat::CommonSet => {
                let left = Reader::new(body).u16("count").map_err(|_| GeneralStatus::NOT_ENOUGH_DATA)?;
                let end = match format {
                    ListFormat::CommonGet => 2 + 2 * usize::from(left),
                    _ => end_of_sets(body, left, table)?,
                };
                match body.len().cmp(&end) {
                    Ordering::Less => return Err(GeneralStatus::NOT_ENOUGH_DATA),
                    Ordering::Equal => (2, left),
                    Ordering::Greater => return Err(GeneralStatus::TOO_MUCH_DATA),
                }
            }
            ListFormat::SingleGet(_) if !body.is_empty() => return Err(GeneralStatus::TOO_MUCH_DATA),
            ListFormat::SingleGet(_) | ListFormat::SingleSet(_) => (0, 1),
        };
        let sets = matches!(format, ListFormat::AxisSet | ListFormat::CommonSet);
        if sets && at + SET_STATUS_LEN * usize::from(left) > limit.min(BODY_MAX) {
            return Err(GeneralStatus::REPLY_DATA_TOO_LARGE);
        }
        let mut response = ArrayVec::new();
        let head = match format {
            ListFormat::AxisGet | ListFormat::AxisSet => HEAD_LEN,
            ListFormat::CommonGet | ListFormat::CommonSet => 2,
            ListFormat::SingleGet(_) | ListFormat::SingleSet(_) => 0,
        };
        response.extend([0; HEAD_LEN].into_iter().take(head));
        Ok(Self { format, request, at, left, response, count: 0, status: GeneralStatus::SUCCESS })
    }

    /// The octets of a Set item.
    pub fn value(&self, item: &Item) -> &[u8] {
        item.value.as_ref().and_then(|range| self.request.get(range.clone())).unwrap_or_default()
    }

    /// Takes the next item. `table` is the one of [`ListJob::new`].
    pub fn next_item(&mut self, table: &AttributeTable) -> Option<Item> {
        self.left = self.left.checked_sub(1)?;
        let rest = self.request.get(self.at..).unwrap_or_default();
        match self.format {
            ListFormat::AxisGet => {
                let selector = AttributeSelector::parse(&mut Reader::new(rest)).ok()?;
                self.at += selector.head_len();
                Some(Item { id: selector.id, selector: Some(selector), value: None })
            }
            ListFormat::AxisSet => {
                let mut reader = Reader::new(rest);
                let selector = AttributeSelector::parse(&mut reader).ok()?;
                let start = self.at + selector.head_len();
                let len = take_value(&mut reader, &selector).ok()?.len();
                self.at += reader.offset();
                Some(Item { id: selector.id, selector: Some(selector), value: Some(start..start + len) })
            }
            ListFormat::CommonGet => {
                let id = Reader::new(rest).u16("attribute").ok()?;
                self.at += 2;
                Some(Item { id, selector: None, value: None })
            }
            ListFormat::CommonSet => {
                let (id, value) = set_item(&self.request, self.at, table).ok()?;
                match &value {
                    Some(value) => self.at = value.end,
                    // Without its length the rest of the list cannot be read: the item is refused and the last one.
                    None => self.left = 0,
                }
                Some(Item { id, selector: None, value: Some(value.unwrap_or_default()) })
            }
            ListFormat::SingleGet(id) => Some(Item { id, selector: None, value: None }),
            ListFormat::SingleSet(id) => {
                Some(Item { id, selector: None, value: Some(0..self.request.len()) })
            }
        }
    }

    fn fail(&mut self, status: GeneralStatus) {
        self.status = status;
        self.left = 0;
    }

    /// Writes the answer of an item. `limit` is the most octets of the response body.
    pub fn answer(&mut self, item: &Item, outcome: Outcome<'_>, limit: usize) {
        let limit = limit.min(BODY_MAX);
        let status = match outcome {
            Outcome::Refused(status, _) => status,
            Outcome::Value(_) | Outcome::Done => GeneralStatus::SUCCESS,
        };
        let mut scratch = [0; BODY_MAX];
        let written = match self.format {
            ListFormat::SingleGet(_) | ListFormat::SingleSet(_) => {
                self.status = status;
                if let Outcome::Value(value) = outcome {
                    append(&mut self.response, value, limit)
                } else {
                    true
                }
            }
            ListFormat::CommonGet | ListFormat::CommonSet => {
                let mut head = [0; 4];
                head[..2].copy_from_slice(&item.id.to_le_bytes());
                head[2] = status.0;
                let value = if let Outcome::Value(value) = outcome { value } else { &[] };
                self.response.len() + 4 + value.len() <= limit
                    && append(&mut self.response, &head, limit)
                    && append(&mut self.response, value, limit)
            }
            ListFormat::AxisGet | ListFormat::AxisSet => {
                match list_item(self.format, item, outcome, &mut scratch) {
                    Some(len) => append(&mut self.response, &scratch[HEAD_LEN..len], limit),
                    None => false,
                }
            }
        };
        if !written {
            self.fail(GeneralStatus::REPLY_DATA_TOO_LARGE);
            return;
        }
        self.count = self.count.saturating_add(1);
        let list = !matches!(self.format, ListFormat::SingleGet(_) | ListFormat::SingleSet(_));
        if list && status != GeneralStatus::SUCCESS {
            self.status = GeneralStatus::ATTRIBUTE_LIST_ERROR;
        }
    }

    /// The response of a job whose items have all been answered: general status and body.
    pub fn finish(&mut self) -> (GeneralStatus, &[u8]) {
        if self.status != GeneralStatus::SUCCESS && self.status != GeneralStatus::ATTRIBUTE_LIST_ERROR {
            return (self.status, &[]);
        }
        if !matches!(self.format, ListFormat::SingleGet(_) | ListFormat::SingleSet(_)) {
            self.response[..2].copy_from_slice(&self.count.to_le_bytes());
        }
        (self.status, &self.response)
    }
}

/// Checks that a list has all the items that it announces, and nothing behind them.
fn whole<T, L>(mut list: L, rest: impl Fn(&L) -> usize) -> Result<(), GeneralStatus>
where
    L: Iterator<Item = Result<T, Error>>,
{
    if list.any(|item| item.is_err()) {
        return Err(GeneralStatus::NOT_ENOUGH_DATA);
    }
    if rest(&list) > 0 { Err(GeneralStatus::TOO_MUCH_DATA) } else { Ok(()) }
}

/// Where a list of so many Sets ends, each an attribute number and the whole value; behind an attribute that nobody has the
/// rest cannot be read, and is taken for a part of the list.
fn end_of_sets(body: &[u8], count: u16, table: &AttributeTable) -> Result<usize, GeneralStatus> {
    let mut at = 2;
    for _ in 0..count {
        match set_item(body, at, table)? {
            (_, Some(value)) => at = value.end,
            (_, None) => return Ok(body.len()),
        }
    }
    Ok(at)
}

/// The item of a Set_Attribute_List at this place: the attribute, and where its value is; `None` if nobody has the attribute.
fn set_item(
    body: &[u8],
    at: usize,
    table: &AttributeTable,
) -> Result<(u16, Option<core::ops::Range<usize>>), GeneralStatus> {
    let rest = body.get(at..).unwrap_or_default();
    let id = Reader::new(rest).u16("attribute").map_err(|_| GeneralStatus::NOT_ENOUGH_DATA)?;
    let Some(entry) = table.find(id) else { return Ok((id, None)) };
    let start = at + 2;
    let size = match entry.definition.data_type {
        DataType::ShortString => 1 + usize::from(*body.get(start).ok_or(GeneralStatus::NOT_ENOUGH_DATA)?),
        _ => entry.definition.size(),
    };
    let value = start..start + size;
    if value.end > body.len() {
        return Err(GeneralStatus::NOT_ENOUGH_DATA);
    }
    Ok((id, Some(value)))
}

/// Writes one item of an axis list behind a head in `scratch`; returns the octets with the head.
fn list_item(format: ListFormat, item: &Item, outcome: Outcome<'_>, scratch: &mut [u8]) -> Option<usize> {
    let mut writer = ListWriter::new(scratch).ok()?;
    match (format, outcome) {
        (ListFormat::AxisGet, Outcome::Value(value)) => {
            let asked = item.selector?;
            if asked.value_len() == Some(value.len()) {
                writer.value(&asked, value)
            } else {
                // Of a string only the answer says how long it is.
                let size = u8::try_from(value.len()).ok()?;
                writer.value(&AttributeSelector::scalar(item.id, size), value)
            }
        }
        (ListFormat::AxisGet, Outcome::Refused(status, _)) => writer.error(item.id, status.0),
        (_, Outcome::Refused(status, index)) => {
            let index = u8::try_from(index).unwrap_or(u8::MAX);
            writer.status(SetStatus { id: item.id, status: status.0, index })
        }
        (_, Outcome::Done | Outcome::Value(_)) => {
            writer.status(SetStatus { id: item.id, status: 0, index: 0 })
        }
    }
    .ok()?;
    Some(writer.finish())
}

fn append(response: &mut ArrayVec<u8, BODY_MAX>, octets: &[u8], limit: usize) -> bool {
    response.len() + octets.len() <= limit && response.try_extend_from_slice(octets).is_ok()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::device::attribute::{Access, AttributeDefinition, Scope};

    const OK: GeneralStatus = GeneralStatus::SUCCESS;

    /// Runs a job whose items end as `outcome` says, and returns what it answers.
    fn run<'v>(
        format: ListFormat,
        body: &[u8],
        limit: usize,
        mut outcome: impl FnMut(&Item, &[u8]) -> Outcome<'v>,
    ) -> (GeneralStatus, Vec<u8>) {
        let definition =
            |id, data_type| AttributeDefinition::new(Scope::Instance, id, data_type, Access::Set, "a");
        let table = AttributeTable::new(
            Scope::Instance,
            &[
                definition(461, DataType::Real),
                definition(462, DataType::Uint),
                definition(463, DataType::ShortString),
            ],
        )
        .expect("a table");
        let mut job = match ListJob::new(format, body, limit, &table) {
            Ok(job) => job,
            Err(status) => return (status, Vec::new()),
        };
        while let Some(item) = job.next_item(&table) {
            let value = job.value(&item).to_vec();
            job.answer(&item, outcome(&item, &value), limit);
        }
        let (status, body) = job.finish();
        (status, body.to_vec())
    }

    #[test]
    fn axis_get_answers_values_and_errors() {
        let body = [2, 0, 0, 0, 25, 0, 0, 4, 29, 0, 0, 4];
        let answer = run(ListFormat::AxisGet, &body, 100, |item, _| match item.id {
            25 => Outcome::Value(&[1, 2, 3, 4]),
            _ => Outcome::Refused(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED, 0),
        });
        let expected = vec![2, 0, 0, 0, 25, 0, 0, 4, 1, 2, 3, 4, 29, 0, 0xFF, 0x14];
        assert_eq!(answer, (GeneralStatus::ATTRIBUTE_LIST_ERROR, expected));
    }

    #[test]
    fn axis_set_hands_out_every_value_and_answers_statuses() {
        let body = [2, 0, 0, 0, 25, 0, 0, 2, 7, 8, 0, 0, 160, 2, 1, 1, 3, 0, 1, 0, 5, 0, 0, 0];
        let mut seen = Vec::new();
        let answer = run(ListFormat::AxisSet, &body, 100, |item, value| {
            seen.push((item.id, value.to_vec()));
            if item.id == 25 {
                Outcome::Done
            } else {
                Outcome::Refused(GeneralStatus::INVALID_ATTRIBUTE_VALUE, 3)
            }
        });
        assert_eq!(seen, [(25, vec![7, 8]), (672, vec![5])]);
        let expected = vec![2, 0, 0, 0, 25, 0, 0, 0, 160, 2, 9, 3];
        assert_eq!(answer, (GeneralStatus::ATTRIBUTE_LIST_ERROR, expected));
    }

    #[test]
    fn a_malformed_list_touches_nothing() {
        let touched = |_: &Item, _: &[u8]| -> Outcome<'_> { panic!("an item was handed out") };
        let body = [2, 0, 0, 0, 25, 0, 0, 2, 7, 8, 0, 0, 26, 0];
        assert_eq!(run(ListFormat::AxisSet, &body, 100, touched).0, GeneralStatus::NOT_ENOUGH_DATA);
        assert_eq!(run(ListFormat::AxisGet, &[9, 0], 100, touched).0, GeneralStatus::NOT_ENOUGH_DATA);
        let short = [2, 0, 1, 0];
        assert_eq!(run(ListFormat::CommonGet, &short, 100, touched).0, GeneralStatus::NOT_ENOUGH_DATA);
        let long = [1, 0, 1, 0, 2];
        assert_eq!(run(ListFormat::CommonGet, &long, 100, touched).0, GeneralStatus::TOO_MUCH_DATA);
    }

    /// 462 has two octets, 461 four, and 463 is a string.
    #[test]
    fn a_malformed_set_attribute_list_touches_nothing() {
        let (short, long) = (GeneralStatus::NOT_ENOUGH_DATA, GeneralStatus::TOO_MUCH_DATA);
        for (what, body, expected) in [
            ("no count", &[1][..], short),
            ("no item", &[1, 0], short),
            ("one item of two", &[2, 0, 0xCE, 1, 7, 8], short),
            ("half an attribute number", &[2, 0, 0xCE, 1, 7, 8, 0xCD], short),
            ("a value that is cut", &[2, 0, 0xCE, 1, 7, 8, 0xCD, 1, 1, 2, 3], short),
            ("no length of a string", &[1, 0, 0xCF, 1], short),
            ("a string that is cut", &[1, 0, 0xCF, 1, 3, b'a', b'b'], short),
            ("octets behind the last item", &[1, 0, 0xCE, 1, 7, 8, 9], long),
            ("octets behind a string", &[1, 0, 0xCF, 1, 1, b'a', b'b'], long),
            ("octets and no item", &[0, 0, 9], long),
        ] {
            let touched = |_: &Item, _: &[u8]| -> Outcome<'_> { panic!("an item was handed out: {what}") };
            assert_eq!(run(ListFormat::CommonSet, body, 100, touched), (expected, vec![]), "{what}");
        }
        let good = [2, 0, 0xCF, 1, 1, b'a', 0xCE, 1, 7, 8];
        let answer = vec![2, 0, 0xCF, 1, 0, 0, 0xCE, 1, 0, 0];
        assert_eq!(run(ListFormat::CommonSet, &good, 100, |_, _| Outcome::Done), (OK, answer));
    }

    #[test]
    fn what_stands_behind_a_list_and_what_will_not_fit_the_answer_touch_nothing() {
        let touched = |_: &Item, _: &[u8]| -> Outcome<'_> { panic!("an item was handed out") };
        let long = GeneralStatus::TOO_MUCH_DATA;
        assert_eq!(run(ListFormat::AxisGet, &[1, 0, 0, 0, 25, 0, 0, 4, 9, 9, 9, 9], 100, touched).0, long);
        assert_eq!(run(ListFormat::AxisSet, &[1, 0, 0, 0, 25, 0, 0, 1, 7, 0, 0, 0, 1], 100, touched).0, long);
        assert_eq!(run(ListFormat::SingleGet(461), &[0], 100, touched).0, long);
        // Three statuses and the count need 14 octets.
        let body = [3, 0, 0xCE, 1, 7, 8, 0xCE, 1, 7, 8, 0xCE, 1, 7, 8];
        assert_eq!(run(ListFormat::CommonSet, &body, 13, touched).0, GeneralStatus::REPLY_DATA_TOO_LARGE);
        assert_eq!(run(ListFormat::CommonSet, &body, 14, |_, _| Outcome::Done).0, OK);
    }

    proptest! {
        /// Any octets under any service: no panic, an answer within its limit, and as many items in it as it says.
        #[test]
        fn any_list_is_answered_within_bounds(
            format in 0..6_u8,
            body in proptest::collection::vec(prop_oneof![3 => 0..6_u8, 1 => any::<u8>()], 0..120),
            limit in 8..300_usize,
            refuses in any::<bool>(),
        ) {
            let formats = [
                ListFormat::AxisGet,
                ListFormat::AxisSet,
                ListFormat::CommonGet,
                ListFormat::CommonSet,
                ListFormat::SingleGet(461),
                ListFormat::SingleSet(461),
            ];
            let format = formats[usize::from(format)];
            let mut items = 0_u16;
            let (status, answer) = run(format, &body, limit, |item, value| {
                items += 1;
                assert!(value.len() <= body.len());
                match item.selector {
                    _ if refuses => Outcome::Refused(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED, 0),
                    Some(selector) if item.value.is_none() => match selector.value_len() {
                        Some(len @ 0..=64) => Outcome::Value(&[0xEE; 64][..len]),
                        _ => Outcome::Refused(GeneralStatus::INVALID_PARAMETER, 0),
                    },
                    None if item.value.is_none() => Outcome::Value(&[1, 2, 3, 4]),
                    _ => Outcome::Done,
                }
            });
            prop_assert!(answer.len() <= limit);
            let single = matches!(format, ListFormat::SingleGet(_) | ListFormat::SingleSet(_));
            if !single && matches!(status, OK | GeneralStatus::ATTRIBUTE_LIST_ERROR) {
                prop_assert_eq!(u16::from_le_bytes([answer[0], answer[1]]), items);
            } else if !single {
                prop_assert_eq!(answer.len(), 0);
            }
        }
    }

    #[test]
    fn common_lists_and_singles() {
        let get = run(ListFormat::CommonGet, &[2, 0, 0xCD, 1, 9, 0], 100, |item, _| match item.id {
            461 => Outcome::Value(&[1, 2, 3, 4]),
            _ => Outcome::Refused(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED, 0),
        });
        let expected = vec![2, 0, 0xCD, 1, 0, 0, 1, 2, 3, 4, 9, 0, 0x14, 0];
        assert_eq!(get, (GeneralStatus::ATTRIBUTE_LIST_ERROR, expected));

        // 462 has two octets, 461 four; the unknown attribute 9 ends the list because its length is unknown.
        let mut seen = Vec::new();
        let body = [4, 0, 0xCE, 1, 7, 8, 0xCD, 1, 1, 2, 3, 4, 9, 0, 1, 1, 0xCE, 1, 1, 2];
        let set = run(ListFormat::CommonSet, &body, 100, |item, value| {
            seen.push((item.id, value.to_vec()));
            if item.id == 9 {
                Outcome::Refused(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED, 0)
            } else {
                Outcome::Done
            }
        });
        assert_eq!(seen, [(462, vec![7, 8]), (461, vec![1, 2, 3, 4]), (9, vec![])]);
        let expected = vec![3, 0, 0xCE, 1, 0, 0, 0xCD, 1, 0, 0, 9, 0, 0x14, 0];
        assert_eq!(set, (GeneralStatus::ATTRIBUTE_LIST_ERROR, expected));

        let single = run(ListFormat::SingleGet(461), &[], 100, |_, _| Outcome::Value(&[5, 6]));
        assert_eq!(single, (OK, vec![5, 6]));
        let refused = run(ListFormat::SingleSet(461), &[1], 100, |_, value| {
            assert_eq!(value, [1]);
            Outcome::Refused(GeneralStatus::NOT_ENOUGH_DATA, 0)
        });
        assert_eq!(refused, (GeneralStatus::NOT_ENOUGH_DATA, vec![]));
    }

    #[test]
    fn an_answer_that_does_not_fit_is_refused_as_a_whole() {
        let body = [2, 0, 0, 0, 25, 0, 0, 4, 26, 0, 0, 4];
        let value = |_: &Item, _: &[u8]| Outcome::Value(&[1, 2, 3, 4]);
        assert_eq!(run(ListFormat::AxisGet, &body, 20, value).0, OK);
        assert_eq!(run(ListFormat::AxisGet, &body, 19, value), (GeneralStatus::REPLY_DATA_TOO_LARGE, vec![]));
    }
}

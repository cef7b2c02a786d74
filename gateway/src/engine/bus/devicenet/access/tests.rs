use super::*;

const AXIS_FAULT: Attribute = Attribute { class: motion::CLASS, id: motion::AXIS_FAULT };
const LIMIT: Attribute = Attribute { class: motion::CLASS, id: 504 };
const SCALE: Attribute = Attribute { class: 0x2A, id: 22 };

fn done(bytes: &[u8]) -> Outcome {
    Outcome::Done(bytes.iter().copied().collect())
}

fn refused(status: GeneralStatus) -> Outcome {
    Outcome::Refused { status, additional: 0xFF }
}

#[test]
fn attributes_beyond_a_byte_are_asked_for_by_a_list() {
    let request = read(AXIS_FAULT).unwrap();
    assert_eq!((request.service, request.class, request.instance), (Service::GET_ATTRIBUTE_LIST, 0x42, 1));
    assert_eq!(request.data[..], [2, 0, 0x95, 2, 0x96, 2], "661 and 662");
    let request = write(LIMIT, &50.0_f32.to_le_bytes()).unwrap();
    assert_eq!(request.service, Service::SET_ATTRIBUTE_LIST);
    assert_eq!(request.data[..], [1, 0, 0xF8, 1, 0, 0, 0x48, 0x42]);
    let request = read(SCALE).unwrap();
    assert_eq!((request.service, &request.data[..]), (Service::GET_ATTRIBUTE_SINGLE, &[22][..]));
    assert_eq!(read(Attribute { class: 0x2A, id: 256 }), None);
    assert_eq!(write(LIMIT, &[0; 100]), None, "longer than a message");
}

#[test]
fn answers_to_lists_are_read_entry_by_entry() {
    let fault = done(&[2, 0, 0x95, 2, 0, 0, 8, 0x96, 2, 0, 0, 3]);
    assert_eq!(value(AXIS_FAULT, &fault).unwrap()[..], [8, 3], "code and type");
    assert_eq!(value(SCALE, &done(&[7])).unwrap()[..], [7]);
    assert_eq!(written(LIMIT, &done(&[1, 0, 0xF8, 1, 0, 0])), Ok(()));
    assert_eq!(written(SCALE, &done(&[])), Ok(()));
}

#[test]
fn what_is_refused_or_makes_no_sense_is_told_apart() {
    let refusal = |refusal| Err(AccessFailure::Refused(refusal));
    assert_eq!(value(SCALE, &refused(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)), refusal(Refusal::Unknown));
    assert_eq!(written(LIMIT, &done(&[1, 0, 0xF8, 1, 9, 0])), refusal(Refusal::Value).map(|_: Data| ()));
    let said = refused_with(&done(&[1, 0, 0xF8, 1, 9, 0]));
    assert_eq!(said, Some(GeneralStatus::INVALID_ATTRIBUTE_VALUE), "the status of the drive itself");
    let busy = GeneralStatus::DEVICE_STATE_CONFLICT;
    assert_eq!(refused_with(&refused(busy)), Some(busy));
    assert_eq!((refused_with(&Outcome::NoAnswer), refused_with(&done(&[1, 0]))), (None, None));
    let whole = [2, 0, 0x95, 2, 0, 0, 8, 0x96, 2, 0, 0, 3];
    for cut in 0..whole.len() - 1 {
        assert_eq!(value(AXIS_FAULT, &done(&whole[..cut])), Err(AccessFailure::Unanswered), "cut at {cut}");
    }
    let unanswered = Err(AccessFailure::Unanswered);
    assert_eq!(written(LIMIT, &done(&[1, 0, 0xF9, 1, 0, 0])), unanswered, "another attribute");
    assert_eq!(written(LIMIT, &Outcome::NoAnswer), unanswered);
}

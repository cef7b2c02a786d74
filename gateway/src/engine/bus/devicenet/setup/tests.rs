use profile_cip::wire::status::GeneralStatus;

use super::*;

fn done(bytes: &[u8]) -> Outcome {
    Outcome::Done(bytes.iter().copied().collect())
}

fn refused(status: GeneralStatus) -> Outcome {
    Outcome::Refused { status, additional: 0xFF }
}

#[test]
fn a_motion_drive_gets_its_limits_and_then_the_word_that_it_is_configured() {
    let steps = motion_steps(&[(504, 50.0), (505, -50.0)]);
    let ids: Vec<_> = steps.iter().map(|step| (step.attribute.class, step.attribute.id)).collect();
    assert_eq!(ids, [(0x42, 504), (0x42, 505), (0x42, 89)]);
    assert_eq!(steps[2].request().data[..], [1, 0, 89, 0, 1]);
    assert_eq!(steps[0].judge(&done(&[1, 0, 0xF8, 1, 0, 0])), Ok(()));
    let told = steps[0].judge(&done(&[1, 0, 0xF8, 1, 0x14, 0])).unwrap_err();
    assert_eq!(told.to_string(), "writing class 0x42 attribute 504: the drive has none");
}

#[test]
fn a_velocity_drive_has_to_have_the_scale_of_the_configuration() {
    let extended = speed_steps(2, true);
    assert_eq!(extended.len(), 1);
    assert_eq!(extended[0].judge(&done(&[2])), Ok(()));
    let told = extended[0].judge(&done(&[0xFF])).unwrap_err();
    assert_eq!(told.to_string(), "class 0x2a attribute 22: expected 2, the drive has -1");
    let none = refused(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED);
    assert!(extended[0].judge(&none).is_err(), "a drive without the attribute has 0");
    assert_eq!(speed_steps(0, true)[0].judge(&none), Ok(()));
    assert!(extended[0].judge(&done(&[2, 0])).is_err() && extended[0].judge(&Outcome::NoAnswer).is_err());
    let basic: Vec<_> = speed_steps(0, false).iter().map(|step| step.attribute.to_string()).collect();
    let wanted = ["class 0x2a attribute 22", "class 0x29 attribute 5", "class 0x2a attribute 4"];
    assert_eq!(basic, wanted);
}

//! How parameters are changed, stored and refused.

use super::*;

#[test]
fn a_mapping_is_changed_in_one_order_only() {
    let mut rig = Rig::new(1);
    let target = 0x607A_0020;
    assert_eq!(rig.set(0x1600, 1, target), Err(AbortCode::ACCESS), "valid");
    assert_eq!(rig.set(0x1600, 0, 0), Err(AbortCode::ACCESS), "valid");
    rig.set(0x1400, 1, 0x8000_0205).unwrap();
    assert_eq!(rig.set(0x1600, 1, target), Err(AbortCode::ACCESS), "not empty");
    rig.set(0x1600, 0, 0).unwrap();
    rig.set(0x1600, 1, 0x6040_0010).unwrap();
    rig.set(0x1600, 2, target).unwrap();
    let refused = [
        (0x9999_0020, AbortCode::NO_OBJECT),
        (0x607D_0520, AbortCode::NO_SUB_INDEX),
        (0x6041_0010, AbortCode::NOT_MAPPABLE),
        (0x1017_0010, AbortCode::NOT_MAPPABLE),
        (0x6040_0008, AbortCode::PARAMETER),
        (0x0005_0010, AbortCode::PARAMETER),
        (0x0001_0001, AbortCode::NOT_MAPPABLE),
    ];
    for (entry, code) in refused {
        assert_eq!(rig.set(0x1600, 3, entry), Err(code), "{entry:08x}");
    }
    rig.set(0x1600, 3, target).unwrap();
    assert_eq!(rig.set(0x1600, 0, 3), Err(AbortCode::PDO_LENGTH), "ten bytes");
    rig.set(0x1600, 3, 0x0006_0010).unwrap();
    assert_eq!(rig.set(0x1600, 0, 9), Err(AbortCode::TOO_HIGH));
    rig.set(0x1600, 0, 3).unwrap();
    rig.set(0x1400, 1, 0x205).unwrap();
    rig.nmt(NmtCommand::START);
    rig.send(0x205, &[6, 0, 0x78, 0x56, 0x34, 0x12, 0xFF, 0xFF]);
    assert_eq!(rig.read(index::TARGET_POSITION, 0), Ok(0x1234_5678));
}

#[test]
fn identifiers_are_checked() {
    let mut rig = Rig::new(1);
    assert_eq!(rig.set(0x1400, 1, 0x206), Err(AbortCode::VALUE), "it is valid");
    for id in [0x000, 0x07F, 0x101, 0x180, 0x581, 0x605, 0x705, 0x7E5, 0x2000_0205_i64] {
        rig.set(0x1400, 1, 0x8000_0205).unwrap();
        assert_eq!(rig.set(0x1400, 1, id), Err(AbortCode::VALUE), "{id:x}");
    }
    rig.set(0x1400, 1, 0x206).unwrap();
    for kind in 0..=255 {
        let expected = if (241..=253).contains(&kind) { Err(AbortCode::VALUE) } else { Ok(()) };
        assert_eq!(rig.set(0x1400, 2, kind), expected, "{kind}");
    }
    assert_eq!(rig.set(0x1005, 0, 0x4000_0080), Err(AbortCode::VALUE), "it produces no SYNC");
    assert_eq!(rig.set(0x1014, 0, 0x86), Err(AbortCode::VALUE), "it is valid");
    rig.set(0x1014, 0, 0x8000_0085).unwrap();
    rig.set(0x1014, 0, 0x90).unwrap();
    rig.set(0x2FFF, 1, 0x7305).unwrap();
    assert_eq!(rig.take_of(0x90).len(), 1);
}

#[test]
fn the_sync_counter_is_set_without_a_period() {
    let mut rig = Rig::new(1);
    assert_eq!(rig.set(0x1019, 0, 1), Err(AbortCode::VALUE));
    assert_eq!(rig.set(0x1019, 0, 241), Err(AbortCode::TOO_HIGH));
    rig.set(0x1006, 0, 1_000).unwrap();
    assert_eq!(rig.set(0x1019, 0, 10), Err(AbortCode::DEVICE_STATE));
    rig.set(0x1006, 0, 0).unwrap();
    rig.set(0x1019, 0, 10).unwrap();
}

#[test]
fn a_node_is_watched_once() {
    let mut rig = Rig::new(1);
    rig.set(0x1016, 1, 0x0001_0064).unwrap();
    assert_eq!(rig.set(0x1016, 2, 0x0001_0032), Err(AbortCode::PARAMETER));
    rig.set(0x1016, 1, 0x0001_0032).unwrap();
    rig.set(0x1016, 2, 0x0002_0032).unwrap();
    assert_eq!(rig.set(0x1016, 3, 0x00FF_0032), Err(AbortCode::VALUE));
    assert_eq!(rig.set(0x1016, 3, 0x0103_0032), Err(AbortCode::VALUE));
}

#[test]
fn parameters_are_stored_and_given_back() {
    let mut rig = Rig::new(1);
    rig.set(0x1017, 0, 100).unwrap();
    rig.set(index::PROFILE_VELOCITY, 0, 777).unwrap();
    assert_eq!(rig.set(0x1010, 1, 1), Err(AbortCode::STORE));
    assert_eq!(rig.set(0x1011, 1, 0x6576_6173), Err(AbortCode::STORE), "save is not load");
    rig.set(0x1010, 3, 0x6576_6173).unwrap();
    assert_eq!(rig.read(0x1010, 3), Ok(1));
    rig.nmt(NmtCommand::RESET_NODE);
    rig.run(100);
    assert_eq!((rig.read(0x1017, 0), rig.read(index::PROFILE_VELOCITY, 0)), (Ok(0), Ok(777)));
    rig.set(0x1011, 1, 0x6461_6F6C).unwrap();
    assert_eq!(rig.read(index::PROFILE_VELOCITY, 0), Ok(777));
    rig.nmt(NmtCommand::RESET_NODE);
    rig.run(100);
    assert_eq!(rig.read(index::PROFILE_VELOCITY, 0), Ok(3_276_800));
}

#[test]
fn a_changed_configuration_is_no_longer_the_verified_one() {
    let mut rig = Rig::new(1);
    rig.set(0x1020, 1, 15_000).unwrap();
    rig.set(0x1020, 2, 1_000).unwrap();
    rig.set(index::MODE, 0, 8).unwrap();
    rig.set(index::PROFILE_VELOCITY, 0, 3_276_800).unwrap();
    assert_eq!((rig.read(0x1020, 1), rig.read(0x1020, 2)), (Ok(15_000), Ok(1_000)), "nothing has changed");
    rig.set(index::PROFILE_VELOCITY, 0, 5).unwrap();
    assert_eq!((rig.read(0x1020, 1), rig.read(0x1020, 2)), (Ok(0), Ok(0)));
}

#[test]
fn axes_have_objects_and_pdos_of_their_own() {
    let mut rig = Rig::new(3);
    assert_eq!(rig.read(0x1000, 0), Ok(0xFFFF_0192));
    for axis in 0..3 {
        assert_eq!(rig.read(0x67FF + 0x800 * axis, 0), Ok(0x0002_0192));
        assert_eq!(rig.read(0x6502 + 0x800 * axis, 0), Ok(0x3EF));
        assert_eq!(rig.read(0x1600 + 0x40 * axis, 1), Ok((0x6040 + 0x800 * u32::from(axis)) << 16 | 0x10));
    }
    assert_eq!(rig.read(0x67FF + 0x1800, 0), Err(AbortCode::NO_OBJECT));
    rig.map(0x1440, 0x210, 255, &[0x6840_0010, 0x6860_0008]);
    rig.nmt(NmtCommand::START);
    rig.send(0x210, &[6, 0, 3]);
    assert_eq!(rig.status(1).state(), Some(State::ReadyToSwitchOn));
    assert_eq!([rig.status(0).state(), rig.status(2).state()], [Some(State::SwitchOnDisabled); 2]);
    assert_eq!([rig.read(0x6061, 0), rig.read(0x6861, 0)], [Ok(0), Ok(3)]);
    rig.set(0x37FF, 1, 0x7305).unwrap();
    assert_eq!(rig.take_of(0x85), [[0x05, 0x73, 0x21, 2, 0, 0, 0, 0]], "axis 2");
}

#[test]
fn eight_axes_are_the_most() {
    let servos = [ServoParameters::default(); 9];
    assert!(Device::new(&servos[..8]).is_ok());
    for count in [0, 9] {
        let error = Device::new(&servos[..count]).err().unwrap();
        assert_eq!(error.to_string(), format!("expected 1 to 8 axes, got {count}"));
    }
}

#[test]
fn scales_that_make_none_are_refused() {
    let mut rig = Rig::new(1);
    assert_eq!(rig.set(index::GEAR_RATIO, 1, 0), Err(AbortCode::TOO_LOW));
    assert_eq!(rig.set(index::MODE, 0, 5), Err(AbortCode::VALUE));
    assert_eq!(rig.set(index::MODE, 0, -1), Err(AbortCode::VALUE));
    assert_eq!(rig.set(index::HOMING_METHOD, 0, 15), Err(AbortCode::VALUE));
    assert_eq!(rig.set(index::HALT_OPTION, 0, 0), Err(AbortCode::TOO_LOW));
}

/// The data sheet is what 1021h says, and names every object.
#[test]
fn the_data_sheet_tells_every_object() {
    let rig = Rig::new(2);
    let text = String::from_utf8(rig.node.eds().to_vec()).unwrap();
    for object in rig.node.dictionary().objects() {
        assert!(text.contains(&format!("\n[{:04X}]\n", object.index)), "{:04x}", object.index);
    }
    for entry in rig.node.dictionary().entries() {
        let name = entry.definition().name;
        assert!(text.contains(&format!("ParameterName={name}\n")), "{name}");
    }
    insta::assert_snapshot!(String::from_utf8(Rig::new(1).node.eds().to_vec()).unwrap());
}

/// The reader of data sheets finds nothing odd in it, and the same objects, axes and PDOs.
#[test]
fn the_data_sheet_reads_as_the_device_is() {
    for axes in [1, 3, 8] {
        let mut rig = Rig::new(axes);
        let reading = crate::eds::read(rig.node.eds()).unwrap();
        assert!(reading.diagnostics.is_empty(), "{:?}", reading.diagnostics.list().first());
        let description = reading.description;
        assert!(description.is_drive());
        let found = description.axes();
        assert_eq!(found.len(), axes);
        assert!(found.iter().all(|axis| axis.modes == Some(0x3EF)));
        for (direction, first) in [
            (crate::eds::drive::Direction::Receive, 0x1400),
            (crate::eds::drive::Direction::Transmit, 0x1800),
        ] {
            let pdos = description.pdos(direction, NODE);
            assert_eq!(pdos.len(), 4 * axes);
            for pdo in pdos {
                assert!(pdo.is_changeable() && pdo.cob_id_writable && pdo.transmission_writable);
                let word = rig.read(first + pdo.number, 1).unwrap();
                assert_eq!(pdo.valid, word >> 31 == 0, "{:x}", first + pdo.number);
                let count = rig.read(first + pdo.number + 0x200, 0).unwrap();
                assert_eq!(pdo.mapping.len(), usize::try_from(count).unwrap());
            }
        }
    }
}

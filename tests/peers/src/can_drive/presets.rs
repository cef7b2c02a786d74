//! Settings near drives of the field, from public manuals, EDS files and reports. No drive was tried.

use super::settings::{
    Block, CyclicBit, PdoDefault, Period, RemoteBit, SafetyReaction, Settings, ShortPdo, VoltageBit,
};

/// 60A9 of a drive with velocities in turns per minute.
const RPM: i64 = 0x00B4_4700;

/// Disables the PDOs from this one on, counted from 0.
fn disable_from(pdos: &mut [PdoDefault], first: usize) {
    for pdo in pdos.iter_mut().skip(first) {
        pdo.valid = false;
    }
}

/// Gives every PDO bit 30 and an inhibit time in 100 us.
fn bit_30_and_inhibit(pdos: &mut [PdoDefault], bit_30: bool, inhibit: u16) {
    for pdo in pdos.iter_mut() {
        pdo.bit_30 = bit_30;
        pdo.inhibit = inhibit;
    }
}

impl Settings {
    /// A drive that counts velocity in rpm.
    fn in_rpm(mut self, counts_per_turn: u32) -> Self {
        self.counts_per_turn = counts_per_turn;
        self.velocity_unit = (i64::from(counts_per_turn), 60);
        self.acceleration_unit = (i64::from(counts_per_turn), 60);
        self.values.push((0x60A9, 0, RPM));
        self.max_velocity = i64::from(counts_per_turn) * 100;
        self.max_acceleration = i64::from(counts_per_turn) * 3000;
        self
    }

    /// maxon EPOS4: stage bit, 605A = 6, most PDOs off, 60C2 off, rpm.
    #[must_use]
    pub fn epos_like() -> Self {
        let mut s = Self {
            vendor: 0xFB,
            product: 0x6150_0000,
            name: "EPOS-like".into(),
            modes: vec![1, 3, 6, 8, 9, 10],
            voltage_bit: VoltageBit::Enabled,
            remote_bit: RemoteBit::Operational,
            bits_always: 0x0100,
            quick_stop_option: 6,
            mode_at_start: 1,
            max_entries: 12,
            ..Self::default()
        }
        .in_rpm(8192);
        s.values.extend([(0x60C2, 1, 0), (0x60C2, 2, -3), (0x6076, 0, 300_000), (0x6098, 0, 7)]);
        disable_from(&mut s.rpdos, 1);
        disable_from(&mut s.tpdos, 1);
        bit_30_and_inhibit(&mut s.tpdos, true, 10);
        s.bit_30_fixed = true;
        s
    }

    /// Oriental BLVD: no synchronous RPDO but type 0, strict remapping, no csp.
    #[must_use]
    pub fn oriental_like() -> Self {
        let mut s = Self {
            vendor: 0x2BE,
            product: 0x13F7,
            name: "BLVD-like".into(),
            modes: vec![1, 3, 6],
            rpdo_types: vec![(0, 0), (254, 255)],
            remap_only_preoperational: true,
            max_entries: 4,
            bits_always: 0x0100,
            resumes_from_quick_stop: false,
            period: Period::Absent,
            store_fails: true,
            homing_methods: (-1, 37),
            mode_at_start: 1,
            ..Self::default()
        }
        .in_rpm(36_000);
        s.values.push((0x6098, 0, 37));
        bit_30_and_inhibit(&mut s.tpdos, true, 50);
        s
    }

    /// Faulhaber 300x of type CO: pp, pv and hm, 4+4 PDOs, device type 420192.
    #[must_use]
    pub fn faulhaber_like() -> Self {
        let mut s = Self {
            vendor: 0x147,
            product: 0xC4E,
            device_type: 0x0042_0192,
            name: "CO-like".into(),
            modes: vec![1, 3, 6],
            period: Period::Absent,
            homing_methods: (0, 36),
            mode_at_start: 1,
            ..Self::default()
        }
        .in_rpm(3000);
        s.values.push((0x6098, 0, 20));
        s
    }

    /// Faulhaber 300x of type CF: 3+3 PDOs with fixed maps, TPDO 2 and 3 on request, no 6502, no 1017.
    #[must_use]
    pub fn faulhaber_cf_like() -> Self {
        let mut s = Self::faulhaber_like();
        s.device_type = 0x0002_0192;
        s.name = "CF-like".into();
        s.missing.push((0x6502, None));
        s.guarding_only = true;
        s.mapping_fixed = true;
        s.cob_id_fixed = true;
        s.not_mappable = vec![0x607A, 0x60FF, 0x6064, 0x606C, 0x6060, 0x6061];
        s.rpdos = vec![
            PdoDefault::new(0x200, &[0x6040_0010]),
            PdoDefault::new(0x300, &[0x2301_0108, 0x2301_0220]),
            PdoDefault::new(0x400, &[0x2303_0108, 0x2303_0220]),
        ];
        s.tpdos = vec![
            PdoDefault::new(0x180, &[0x6041_0010]),
            PdoDefault::new(0x280, &[0x2301_0108, 0x2301_0220]),
            PdoDefault::new(0x380, &[0x2303_0108, 0x2303_0220]),
        ];
        for pdo in s.tpdos.iter_mut().skip(1) {
            pdo.kind = 253;
        }
        s
    }

    /// Kollmorgen AKD and S300: bit 4 is the DC link, bit 6 in "not ready".
    #[must_use]
    pub fn akd_like() -> Self {
        let mut s = Self {
            vendor: 0x6A,
            product: 0x0041_4B44,
            name: "AKD-like".into(),
            modes: vec![1, 3, 4, 6, 7, 8],
            not_ready_ms: 50,
            not_ready_bit_6: true,
            mode_at_start: 1,
            ..Self::default()
        };
        disable_from(&mut s.rpdos, 1);
        disable_from(&mut s.tpdos, 1);
        s
    }

    /// Technosoft iPOS: words within 1 ms are missed, 16.16 velocity, torque that is no thousandth.
    #[must_use]
    pub fn ipos_like() -> Self {
        let mut s = Self {
            vendor: 0x1A3,
            product: 0x0142_9000,
            device_type: 0x0006_0192,
            name: "iPOS-like".into(),
            modes: vec![1, 3, 6, 7],
            modes_shown: Some(0x001F_0065),
            control_gap_us: 1000,
            velocity_unit: (1000, 65_536),
            acceleration_unit: (1_000_000, 65_536),
            torque_rated: 10_920,
            mode_detour: Some((3, 6)),
            ..Self::default()
        };
        disable_from(&mut s.tpdos, 2);
        bit_30_and_inhibit(&mut s.tpdos, false, 300);
        s
    }

    /// Kollmorgen RGM: ten PDOs each way, all off, maps fixed, 6502 empty.
    #[must_use]
    pub fn kollmorgen_rgm_like() -> Self {
        let mut s = Self {
            vendor: 0xBD,
            product: 0x0001_0204,
            name: "RGM-like".into(),
            modes: vec![1, 3, 4, 6, 7, 8],
            modes_shown: Some(0),
            mapping_fixed: true,
            mode_at_start: 1,
            ..Self::default()
        };
        let mut more = vec![
            PdoDefault::new(0, &[0x6040_0010, 0x6071_0010]),
            PdoDefault::new(0, &[0x6040_0010, 0x60C1_0120]),
            PdoDefault::new(0, &[0x607A_0020, 0x6081_0020]),
            PdoDefault::new(0, &[0x6083_0020, 0x6084_0020]),
            PdoDefault::new(0, &[0x6060_0008]),
            PdoDefault::new(0, &[0x607A_0020]),
        ];
        s.rpdos.append(&mut more);
        let mut more = vec![
            PdoDefault::new(0, &[0x6041_0010, 0x6077_0010]),
            PdoDefault::new(0, &[0x6064_0020, 0x606C_0020]),
            PdoDefault::new(0, &[0x60F4_0020]),
            PdoDefault::new(0, &[0x60FD_0020]),
            PdoDefault::new(0, &[0x6061_0008]),
            PdoDefault::new(0, &[0x6064_0020]),
        ];
        s.tpdos.append(&mut more);
        disable_from(&mut s.rpdos, 0);
        disable_from(&mut s.tpdos, 0);
        s
    }

    /// Eyou: its device type is not of the profile, no homing, 6060 = 0 in a PDO clears 6061.
    #[must_use]
    pub fn eyou_like() -> Self {
        let mut s = Self {
            vendor: 0x668,
            product: 0x1234,
            device_type: 0x0022_0811,
            name: "Eyou-like".into(),
            modes: vec![1, 3, 4, 7, 8, 9, 10],
            quick_stop_option: 1,
            mode_zero_clears: true,
            bit_30_fixed: true,
            ..Self::default()
        };
        s.values.extend([(0x60C2, 1, 1), (0x60C2, 2, -3)]);
        bit_30_and_inhibit(&mut s.tpdos, true, 0);
        s
    }

    /// ZeroErr eRob: bits 7 and 12 of the statusword are always 1.
    #[must_use]
    pub fn zeroerr_like() -> Self {
        Self {
            vendor: 0x5A65_726F,
            product: 0x0002_9252,
            name: "eRob-like".into(),
            modes: vec![1, 3, 4, 8, 9, 10],
            bits_always: 0x1080,
            ..Self::default()
        }
    }

    /// Elmo Gold: device type 192, no "no mode", a fault reset only after a second, STO leaves it switched on.
    #[must_use]
    pub fn elmo_like() -> Self {
        Self {
            vendor: 0x9A,
            product: 0x0003_0923,
            device_type: 0x0192,
            name: "Gold-like".into(),
            modes: vec![1, 3, 4, 6, 7, 8, 9, 10],
            mode_at_start: 1,
            mode_zero_refused: true,
            safety: SafetyReaction::SwitchedOn,
            reset_blocked_ms: 1000,
            cyclic_bit_10: CyclicBit::One,
            homing_methods: (-128, 35),
            ..Self::default()
        }
    }

    /// Schneider LXM28-like and others: a short PDO is a drive error, block transfers get no answer.
    #[must_use]
    pub fn lexium_like() -> Self {
        Self {
            vendor: 0x0800_005A,
            product: 0x0009_6030,
            name: "Lexium-like".into(),
            modes: vec![1, 3, 4, 6, 7, 8],
            remap_only_preoperational: true,
            short_pdo: ShortPdo::Fault,
            block: Block::Silent,
            ..Self::default()
        }
    }
}

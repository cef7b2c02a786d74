//! Size and access of the attributes of a Motion Device Axis instance, from the attribute tables of CIP Volume 9.

/// What the tables say of an attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// The bytes of an element.
    pub size: usize,
    /// The number of elements.
    pub count: usize,
    /// Whether it can be set.
    pub settable: bool,
}

/// The row of an instance attribute. Feedback attributes are there for two feedbacks.
#[must_use]
pub fn row(attribute: u16) -> Option<Row> {
    let (size, count, settable) = match attribute {
        672 | 673 => (1, 64, true),
        522 | 631..=634 | 650 | 661 | 662 | 664..=669 | 760 => (1, 1, false),
        40..=43
        | 45
        | 77
        | 79
        | 83
        | 89..=92
        | 94..=97
        | 380
        | 381
        | 446
        | 467
        | 558
        | 560
        | 563
        | 564
        | 570
        | 590
        | 610
        | 614
        | 622..=624
        | 627
        | 629
        | 646..=648
        | 736
        | 737
        | 750
        | 765
        | 1313
        | 1315..=1317
        | 1323
        | 1370
        | 1373
        | 1375
        | 1377
        | 1410..=1415
        | 1420
        | 1421
        | 1426
        | 1427
        | 1460..=1465
        | 1470
        | 1471
        | 1476
        | 1477 => (1, 1, true),
        676 | 677 | 756 | 757 => (2, 1, false),
        604 | 1329 => (2, 1, true),
        61..=65
        | 70
        | 365..=367
        | 430
        | 432..=434
        | 436..=438
        | 450
        | 452..=457
        | 480
        | 482
        | 483
        | 490
        | 492..=494
        | 520
        | 521
        | 523..=525
        | 527..=543
        | 565
        | 600..=603
        | 605
        | 606
        | 620
        | 621
        | 635..=645
        | 651..=654
        | 674
        | 675
        | 678..=693
        | 710..=712
        | 714
        | 715
        | 720..=725
        | 730
        | 732
        | 733
        | 761..=764
        | 1402..=1404
        | 1452..=1454 => (4, 1, false),
        44
        | 60
        | 78
        | 84
        | 360
        | 362..=364
        | 370..=378
        | 431
        | 440..=445
        | 447..=449
        | 451
        | 460..=462
        | 464..=466
        | 468..=474
        | 481
        | 485
        | 486
        | 491
        | 496
        | 498..=500
        | 502..=511
        | 553..=557
        | 559
        | 561
        | 562
        | 572
        | 573
        | 575..=578
        | 591..=594
        | 608
        | 609
        | 611..=613
        | 615..=617
        | 625
        | 628
        | 630
        | 694..=709
        | 731
        | 734
        | 735
        | 1314
        | 1318..=1322
        | 1324..=1328
        | 1330..=1354
        | 1371
        | 1372
        | 1374
        | 1376
        | 1416..=1419
        | 1422..=1425
        | 1434
        | 1435
        | 1466..=1469
        | 1472..=1475
        | 1484
        | 1485 => (4, 1, true),
        66..=69 | 71..=73 | 93 | 655..=660 | 663 | 670 | 713 => (8, 1, false),
        361 => (8, 1, true),
        _ => return None,
    };
    Some(Row { size, count, settable })
}

/// The row of a class attribute.
#[must_use]
pub fn class_row(attribute: u16) -> Option<Row> {
    let (size, settable) = match attribute {
        1..=3 => (2, false),
        14 | 21 | 22 | 31..=33 => (1, true),
        15..=17 => (1, false),
        18 | 29 | 35 => (4, true),
        19 | 20 => (8, true),
        28 | 30 | 34 => (4, false),
        _ => return None,
    };
    Some(Row { size, count: 1, settable })
}

/// Whether every drive lets the attribute be set in the Running state.
#[must_use]
pub fn settable_while_running(attribute: u16) -> bool {
    matches!(
        attribute,
        370..=378 | 440..=447 | 460..=462 | 464..=474 | 485 | 486 | 496 | 498..=500 | 502..=511 | 553..=557 | 731 | 734 | 735
    )
}

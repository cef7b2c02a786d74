//! The device role: the explicit side ([`adapter`]) and the motion device behind it.

pub mod motion_link;
pub mod axis_state;
pub mod attribute;
mod axis_control;
mod time_offset;
pub mod drive_link;
mod list_job;
mod status_report;
mod event_channel;
pub mod attribute_worker;
mod cyclic_list;

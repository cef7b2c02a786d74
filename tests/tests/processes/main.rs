//! The program as a user runs it: processes on real sockets, in real time.

mod control;
mod demo;
mod doctor;
mod ending;
mod histories;
mod http;
mod http_control;
mod init;
mod local;
mod package;
mod page;
mod page_parameters;
mod param;
mod recording;
mod reload;
mod scripts;
mod size;
mod systemd;
mod two_clocks;

//! What programs of other makers make of us: tshark, pycomm3, ethernetip, nmap, and a foreign master's recording.

mod devicenet;
mod foreign_clients;
mod recording;
mod tshark_blocks;

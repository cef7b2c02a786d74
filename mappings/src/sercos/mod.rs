//! Generic <-> SERCOS: from the tables and what a drive tells to the telegram, the commissioning and the program of an axis.

pub(crate) mod captures;
pub(crate) mod commissioning;
pub(crate) mod compile;
pub(crate) mod facts;
pub(crate) mod fixed_connections;
mod modes;
pub(crate) mod scaling;
mod survey;
pub(crate) mod tables;

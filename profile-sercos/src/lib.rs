//! SERCOS III: telegrams, phases, service channel, master and slave roles.

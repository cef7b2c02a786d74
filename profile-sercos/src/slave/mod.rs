//! The slave role: phases, service channel server, parameters, cyclic data, and the simulated drive behind it.

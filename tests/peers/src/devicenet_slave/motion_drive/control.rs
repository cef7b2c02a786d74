//! Axis Control: what the controller asks the axis to do, and when it is done.

use super::super::settings::Settings;
use super::{
    ABORTING, BAD_VALUE, CONTROLLER_EXCEPTION, MAJOR_FAULTED, MotionDrive, PRE_CHARGE, RUNNING, SHUTDOWN,
    STARTING, STATE_CONFLICT, STOPPED, STOPPING,
};

impl MotionDrive {
    /// Takes Axis Control.
    pub(super) fn control(&mut self, settings: &Settings, request: u8) {
        if request == self.request {
            return;
        }
        self.request = request;
        (self.response, self.response_status) = (0, 0);
        if request == 0 {
            return;
        }
        if request == 127 {
            self.response = 127;
            return;
        }
        self.working_on = request;
        let enabled = matches!(self.state, STARTING | RUNNING);
        match request {
            1 => match self.state {
                STOPPED => self.start(),
                STOPPING if self.byte(380) & 1 != 0 => self.start(),
                STARTING => {}
                RUNNING => self.finish(1, 0),
                _ => self.finish(1, STATE_CONFLICT),
            },
            2 => {
                if enabled {
                    self.enter(STOPPING);
                } else if !matches!(self.state, STOPPING | ABORTING) {
                    self.finish(2, 0);
                }
            }
            3 => {
                self.shutdown = true;
                match self.state {
                    STARTING | RUNNING => self.enter(STOPPING),
                    STOPPING | ABORTING => {}
                    MAJOR_FAULTED => self.finish(3, 0),
                    _ => {
                        self.enter(SHUTDOWN);
                        self.finish(3, 0);
                    }
                }
            }
            4 | 6 => self.reset(settings, request),
            5 => {
                self.trip(CONTROLLER_EXCEPTION, false);
                self.finish(5, 0);
            }
            7 | 9 => self.finish(request, 0),
            8 => {
                self.position += f64::from(self.displacement);
                self.command_position += f64::from(self.displacement);
                self.finish(8, 0);
            }
            _ => self.finish(request, BAD_VALUE),
        }
    }

    fn start(&mut self) {
        self.enter(STARTING);
        self.command_position = self.position;
    }

    /// Fault Reset and Shutdown Reset.
    fn reset(&mut self, settings: &Settings, request: u8) {
        let refused = u64::from(settings.reset_refused_ms) * 1000;
        if self.fault.is_some_and(|fault| self.now_us < fault.since_us + refused) {
            self.finish(request, STATE_CONFLICT);
            return;
        }
        match self.state {
            MAJOR_FAULTED => {
                if request == 4 {
                    self.shutdown = false;
                }
                self.fault = None;
                self.reset_source = if request == 4 { 3 } else { 2 };
                self.recover();
            }
            ABORTING if request == 6 => {
                self.fault = None;
                self.reset_source = 2;
                self.enter(STOPPING);
            }
            SHUTDOWN if request == 4 => {
                self.shutdown = false;
                self.enter(PRE_CHARGE);
            }
            _ => {}
        }
        self.finish(request, 0);
    }
}

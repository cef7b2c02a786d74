//! The commissioning of drives alongside the cycle thread: it allocates, and a drive can come while others move.
//!
//! ```text
//! cycle thread                            commissioner, on a thread of its own
//!   Order ------------------------------>  plans what the drive is asked and written
//!   <----------------------------- Submit
//!   Outcome, Unsent -------------------->  keeps what the drive reports
//!   <--------------------- Made, or Failed
//! ```
//!
//! The messages are the same on every bus; what is ordered, requested and made is the bus's own ([`Work`]). A message belongs
//! to one [`Run`] of one drive. What was made for a drive that has gone again comes back as [`Job::Unused`] and is freed here.

use std::collections::VecDeque;

use crate::engine::notice::Notice;

/// Which commissioning of which drive a message belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Run {
    /// Place of the drive or device among those of the bus.
    pub place: u8,
    /// Counts the times that it came; messages of an earlier time are not used.
    pub number: u32,
}

impl Run {
    /// Run `number` of the drive in this place.
    #[must_use]
    pub fn new(place: usize, number: u32) -> Self {
        Self { place: u8::try_from(place).unwrap_or(u8::MAX), number }
    }
}

/// The commissioning of one drive or device.
pub trait Work {
    /// What the cycle thread orders.
    type Order: std::fmt::Debug;
    /// A request to the drive.
    type Request: std::fmt::Debug;
    /// The result of a request.
    type Outcome: std::fmt::Debug;
    /// What the cycle thread gets for the drive.
    type Made: std::fmt::Debug;
    /// What the work on every drive of the bus shares.
    type Shared: std::fmt::Debug;

    /// The run that is under way.
    fn run(&self) -> Run;

    /// Begins or changes the work.
    fn order(&mut self, run: Run, order: Self::Order, context: &mut Context<Self>);

    /// Takes the result of a request of this run.
    fn handle(&mut self, outcome: &Self::Outcome, context: &mut Context<Self>);

    /// Ends the work: a request could not be made.
    fn give_up(&mut self);
}

/// What the work on a drive has around it.
#[derive(Debug)]
pub struct Context<W: Work + ?Sized> {
    /// What the work on every drive of the bus shares.
    pub shared: W::Shared,
    /// Messages for the cycle thread, until the queue has room for them.
    pub out: VecDeque<Done<W>>,
}

/// What the cycle thread wants.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "queue slots have one size, and boxing would allocate")]
pub enum Job<W: Work + ?Sized> {
    /// A drive is to be worked on.
    Order(Run, W::Order),
    /// The result of a request.
    Outcome(Run, W::Outcome),
    /// A request that could not be made.
    Unsent(Run, W::Request),
    /// The result of a request that nobody waits for any more.
    Spent(W::Outcome),
    /// Something that is not needed any more.
    Unused(Done<W>),
}

/// What the commissioner has done.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "queue slots have one size, and boxing would allocate")]
pub enum Done<W: Work + ?Sized> {
    /// A request to the drive.
    Submit(Run, W::Request),
    /// Something is ready for the drive.
    Made(Run, W::Made),
    /// The drive cannot be used.
    Failed(Run, Notice),
    /// Something that people should know.
    Told(Notice),
}

impl<W: Work> Done<W> {
    /// The run it belongs to.
    #[must_use]
    pub fn run(&self) -> Option<Run> {
        match self {
            Self::Submit(run, _) | Self::Made(run, _) | Self::Failed(run, _) => Some(*run),
            Self::Told(_) => None,
        }
    }
}

/// The cycle thread's end. Nothing of it waits or allocates.
#[derive(Debug)]
pub struct CommissionerHandle<W: Work> {
    jobs: rtrb::Producer<Job<W>>,
    done: rtrb::Consumer<Done<W>>,
}

impl<W: Work> CommissionerHandle<W> {
    /// Hands a job over; `false` when there is no room, and it is dropped.
    pub fn push(&mut self, job: Job<W>) -> bool {
        self.jobs.push(job).is_ok()
    }

    /// Whether a job can be handed over now.
    #[must_use]
    pub fn has_room(&self) -> bool {
        !self.jobs.is_full()
    }

    /// The next message of a drive. As each can lead to one job, there is none while there is no room for that. What people should
    /// know goes to `notice`.
    pub fn pop(&mut self, notice: &mut dyn FnMut(Notice)) -> Option<(Run, Done<W>)> {
        while self.has_room() {
            match self.done.pop().ok()? {
                Done::Told(told) => notice(told),
                done => return Some((done.run()?, done)),
            }
        }
        None
    }
}

/// Commissions the drives of a bus.
#[derive(Debug)]
pub struct Commissioner<W: Work> {
    context: Context<W>,
    works: Vec<W>,
    jobs: rtrb::Consumer<Job<W>>,
    done: rtrb::Producer<Done<W>>,
}

impl<W: Work> Commissioner<W> {
    /// A commissioner for these drives and the cycle thread's end, with room for so many messages in each direction.
    #[must_use]
    pub fn with_queue(queue: usize, shared: W::Shared, works: Vec<W>) -> (Self, CommissionerHandle<W>) {
        let (jobs_in, jobs) = rtrb::RingBuffer::new(queue);
        let (done, done_out) = rtrb::RingBuffer::new(queue);
        let handle = CommissionerHandle { jobs: jobs_in, done: done_out };
        let context = Context { shared, out: VecDeque::new() };
        (Self { context, works, jobs, done }, handle)
    }

    /// Whether the cycle thread has gone.
    #[must_use]
    pub fn is_abandoned(&self) -> bool {
        self.jobs.is_abandoned()
    }

    /// Does what there is to do, without waiting.
    pub fn poll(&mut self) {
        let Self { context, works, jobs, done } = self;
        while let Ok(job) = jobs.pop() {
            match job {
                Job::Order(run, order) => {
                    if let Some(work) = works.get_mut(usize::from(run.place)) {
                        work.order(run, order, context);
                    }
                }
                Job::Outcome(run, outcome) => {
                    if let Some(work) = under_way(works, run) {
                        work.handle(&outcome, context);
                    }
                }
                Job::Unsent(run, _) => {
                    if let Some(work) = under_way(works, run) {
                        work.give_up();
                    }
                }
                Job::Spent(_) | Job::Unused(_) => {}
            }
        }
        while let Some(message) = context.out.pop_front() {
            if let Err(rtrb::PushError::Full(message)) = done.push(message) {
                context.out.push_front(message);
                return;
            }
        }
    }
}

/// The work of a run, unless another one has begun since.
fn under_way<W: Work>(works: &mut [W], run: Run) -> Option<&mut W> {
    works.get_mut(usize::from(run.place)).filter(|work| work.run() == run)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drive that is asked for each number up to the one ordered.
    #[derive(Debug, Default)]
    struct Counting {
        run: Run,
        left: u32,
    }

    impl Work for Counting {
        type Order = u32;
        type Request = u32;
        type Outcome = u32;
        type Made = u32;
        type Shared = u32;

        fn run(&self) -> Run {
            self.run
        }

        fn order(&mut self, run: Run, order: u32, context: &mut Context<Self>) {
            *self = Self { run, left: order };
            context.out.push_back(Done::Submit(run, order));
        }

        fn handle(&mut self, outcome: &u32, context: &mut Context<Self>) {
            context.shared += outcome;
            self.left = self.left.saturating_sub(1);
            context.out.push_back(match self.left {
                0 => Done::Made(self.run, context.shared),
                left => Done::Submit(self.run, left),
            });
        }

        fn give_up(&mut self) {
            self.left = 0;
        }
    }

    fn pair(queue: usize) -> (Commissioner<Counting>, CommissionerHandle<Counting>) {
        Commissioner::with_queue(queue, 0, vec![Counting::default(), Counting::default()])
    }

    /// Messages as text, oldest first.
    fn taken(handle: &mut CommissionerHandle<Counting>) -> Vec<String> {
        std::iter::from_fn(|| handle.pop(&mut |_| {})).map(|(_, done)| format!("{done:?}")).collect()
    }

    #[test]
    fn what_belongs_to_an_earlier_run_is_not_used() {
        let (mut commissioner, mut handle) = pair(4);
        let (first, second) = (Run::new(1, 1), Run::new(1, 2));
        assert!(handle.push(Job::Order(first, 2)) && handle.push(Job::Order(second, 1)));
        assert!(handle.push(Job::Outcome(first, 100)) && handle.push(Job::Outcome(second, 7)));
        commissioner.poll();
        let run = |number| format!("Run {{ place: 1, number: {number} }}");
        let expected = [
            format!("Submit({}, 2)", run(1)),
            format!("Submit({}, 1)", run(2)),
            format!("Made({}, 7)", run(2)),
        ];
        assert_eq!(taken(&mut handle), expected, "100 came too late");
    }

    #[test]
    fn what_the_queue_has_no_room_for_waits_in_order() {
        let (mut commissioner, mut handle) = pair(1);
        for number in 1..=3 {
            assert!(handle.push(Job::Order(Run::new(0, number), number)));
            commissioner.poll();
        }
        let mut seen = Vec::new();
        for _ in 0..4 {
            seen.append(&mut taken(&mut handle));
            commissioner.poll();
        }
        let order: Vec<_> = seen.iter().map(|text| &text[text.len() - 2..]).collect();
        assert_eq!(order, ["1)", "2)", "3)"]);
    }

    #[test]
    fn a_message_is_not_taken_while_its_answer_has_no_room() {
        let (mut commissioner, mut handle) = pair(1);
        assert!(handle.push(Job::Order(Run::new(0, 1), 1)));
        commissioner.poll();
        assert!(handle.push(Job::Spent(0)) && !handle.has_room());
        assert!(handle.pop(&mut |_| {}).is_none());
        commissioner.poll();
        assert!(matches!(handle.pop(&mut |_| {}), Some((_, Done::Submit(_, 1)))));
    }

    #[test]
    fn an_order_for_a_drive_that_is_not_there_changes_nothing() {
        let (mut commissioner, mut handle) = pair(2);
        assert!(handle.push(Job::Order(Run::new(2, 1), 1)));
        commissioner.poll();
        assert!(taken(&mut handle).is_empty() && !commissioner.is_abandoned());
        drop(handle);
        assert!(commissioner.is_abandoned());
    }
}

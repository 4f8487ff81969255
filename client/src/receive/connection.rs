//! Keeping a connection: when to open it, when to try again, and what to tell the person meanwhile.
//!
//! A sans-IO state machine. Its driver opens and closes sockets when [`Connection::poll`] says so, and reports what became of
//! them. Waits double from [`FIRST_WAIT_S`] to [`LONGEST_WAIT_S`] and begin anew after a session that worked.

/// The wait before the first new try, in seconds: a restarted server is back in less than that.
pub const FIRST_WAIT_S: f64 = 0.5;
/// The longest wait: a person who watches sees something happen.
pub const LONGEST_WAIT_S: f64 = 8.0;
/// A server that has not said welcome after this is given up, in seconds. A path may be slow.
pub const WELCOME_WITHIN_S: f64 = 15.0;
/// A session that lasted this long worked: the next wait is the first one again.
const WORKED_AFTER_S: f64 = 5.0;
/// After a session that worked the server is known to be there, and waits are short: who comes back after a stretch without any network is to see the
/// scene go on within three seconds.
const LONGEST_WAIT_TO_COME_BACK_S: f64 = 0.5;
/// To come back, a try lasts so long at least, and so many round trips of the last session: a handshake takes three. One whose first packet was lost would only
/// be repeated after ever longer pauses.
const LEAST_TRY_S: f64 = 2.0;
const TRY_ROUND_TRIPS: f64 = 6.0;
/// Every so manieth try lasts twice as long, and rarely one as long as a first one: the path may have become slower.
const PATIENT_TRIES: u32 = 4;
const MOST_PATIENT_TRIES: u32 = 16;
/// After so many tries, two minutes, the server has nothing left of the session, and there is no hurry any more.
const TRIES_TO_COME_BACK: u32 = 48;

/// What the driver must do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Open a socket to the address.
    Open,
    /// Close the socket that is open or opening; report nothing for it any more.
    Close,
}

/// Why a connection ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    /// It never came about; what was said about it, possibly nothing.
    Unreachable(String),
    /// The other end closed it, or it broke; what was said about it, possibly nothing.
    Closed(String),
    /// The server gave a reason.
    Goodbye(String),
    /// The server gave a reason that will be the same for who comes again just as before.
    Refused(String),
    /// The other end broke the protocol.
    Fault(String),
}

#[derive(Debug, Clone, PartialEq)]
enum State {
    Waiting {
        until_s: f64,
    },
    /// Until a person asks for another try.
    Refused,
    Opening {
        since_s: f64,
    },
    Greeting {
        since_s: f64,
    },
    Working {
        since_s: f64,
    },
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Connection {
    address: String,
    state: State,
    next_wait_s: f64,
    /// Of the last session, where it worked, its smoothed round trip in seconds.
    comes_back: Option<f64>,
    tries: u32,
    ended: Option<Ended>,
}

impl Connection {
    /// To be opened at once. The address is what a person is shown.
    pub fn new(address: impl Into<String>, now_s: f64) -> Connection {
        Connection {
            address: address.into(),
            state: State::Waiting { until_s: now_s },
            next_wait_s: FIRST_WAIT_S,
            comes_back: None,
            tries: 0,
            ended: None,
        }
    }

    /// What to do now.
    pub fn poll(&mut self, now_s: f64) -> Option<Command> {
        match self.state {
            State::Waiting { until_s } if now_s >= until_s => {
                self.state = State::Opening { since_s: now_s };
                self.tries = self.tries.wrapping_add(1);
                Some(Command::Open)
            }
            State::Opening { since_s } if now_s - since_s > self.try_lasts_s() => {
                self.ended(Ended::Unreachable(String::new()), now_s);
                Some(Command::Close)
            }
            State::Greeting { since_s } if now_s - since_s > self.try_lasts_s() => {
                self.ended(Ended::Fault("it did not answer".to_owned()), now_s);
                Some(Command::Close)
            }
            _ => None,
        }
    }

    fn try_lasts_s(&self) -> f64 {
        match self.comes_back {
            Some(round_trip_s) if !self.tries.is_multiple_of(MOST_PATIENT_TRIES) => {
                let times = if self.tries.is_multiple_of(PATIENT_TRIES) { 2.0 } else { 1.0 };
                (times * (TRY_ROUND_TRIPS * round_trip_s).max(LEAST_TRY_S)).min(WELCOME_WITHIN_S)
            }
            _ => WELCOME_WITHIN_S,
        }
    }

    /// The socket is open.
    pub fn opened(&mut self, now_s: f64) {
        if matches!(self.state, State::Opening { .. }) {
            self.state = State::Greeting { since_s: now_s };
        }
    }

    /// The server said welcome.
    pub fn welcomed(&mut self, now_s: f64) {
        if matches!(self.state, State::Greeting { .. }) {
            self.state = State::Working { since_s: now_s };
            (self.comes_back, self.tries) = (None, 0);
        }
    }

    /// The session that runs has this round trip, in seconds.
    pub fn measured(&mut self, round_trip_s: f64) {
        if matches!(self.state, State::Working { .. }) {
            self.comes_back = Some(round_trip_s);
        }
    }

    /// The socket is gone, or must go.
    pub fn ended(&mut self, why: Ended, now_s: f64) {
        match self.state {
            State::Waiting { .. } | State::Refused => return,
            State::Working { since_s } if now_s - since_s >= WORKED_AFTER_S => self.next_wait_s = FIRST_WAIT_S,
            State::Working { .. } => self.comes_back = None,
            _ => {}
        }
        let why = match (why, &self.state) {
            (Ended::Closed(said), State::Opening { .. }) => Ended::Unreachable(said),
            (why, _) => why,
        };
        // Who is told to come again, or tried for long, is in no hurry.
        if matches!(why, Ended::Goodbye(_)) || self.tries >= TRIES_TO_COME_BACK {
            self.comes_back = None;
        }
        let is_refused = matches!(why, Ended::Refused(_));
        self.ended = Some(why);
        self.state = if is_refused { State::Refused } else { State::Waiting { until_s: now_s + self.next_wait_s } };
        let longest_s = if self.comes_back.is_some() { LONGEST_WAIT_TO_COME_BACK_S } else { LONGEST_WAIT_S };
        self.next_wait_s = (self.next_wait_s * 2.0).min(longest_s);
    }

    /// Tries again at once, because a person asked for it.
    pub fn retry_now(&mut self, now_s: f64) {
        if matches!(self.state, State::Waiting { .. } | State::Refused) {
            self.state = State::Waiting { until_s: now_s };
        }
    }

    /// Whether the server has said welcome.
    pub fn is_working(&self) -> bool {
        matches!(self.state, State::Working { .. })
    }

    /// Whether the server lets nobody in who comes as this client does.
    pub fn is_refused(&self) -> bool {
        self.state == State::Refused
    }

    /// Whether it waits for its next try.
    pub fn is_waiting(&self) -> bool {
        matches!(self.state, State::Waiting { .. })
    }

    /// The server's own reason, where that was the last thing to end a session.
    pub fn goodbye(&self) -> Option<&str> {
        match &self.ended {
            Some(Ended::Goodbye(reason) | Ended::Refused(reason)) => Some(reason),
            _ => None,
        }
    }

    /// What a person should know, or `None` while all is well.
    pub fn status(&self, now_s: f64) -> Option<String> {
        let address = &self.address;
        match &self.state {
            State::Waiting { until_s } => {
                let why = match &self.ended {
                    None => format!("connecting to {address}"),
                    Some(Ended::Unreachable(said)) if said.is_empty() => format!("cannot reach {address}"),
                    Some(Ended::Unreachable(said)) => format!("cannot reach {address}: {said}"),
                    Some(Ended::Closed(said)) if said.is_empty() => "the connection was lost".to_owned(),
                    Some(Ended::Closed(said)) => format!("the connection was lost: {said}"),
                    Some(Ended::Goodbye(reason) | Ended::Refused(reason)) => {
                        format!("server closed the connection: {reason}")
                    }
                    Some(Ended::Fault(fault)) => format!("something is wrong with the server at {address}: {fault}"),
                };
                let wait_s = (until_s - now_s).max(0.0).ceil();
                Some(if wait_s >= 1.0 { format!("{why}, retrying in {wait_s} s") } else { format!("{why}, retrying") })
            }
            State::Refused => Some(format!("{address} does not let you in: {}", self.goodbye().unwrap_or_default())),
            State::Opening { .. } => Some(match &self.ended {
                None => format!("connecting to {address}"),
                Some(_) => format!("connecting to {address} again"),
            }),
            State::Greeting { since_s } if now_s - since_s > 2.0 => Some(format!("waiting for {address} to answer")),
            State::Greeting { .. } => Some(format!("connected to {address}")),
            State::Working { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(connection: &mut Connection, now_s: f64) {
        assert_eq!(connection.poll(now_s), Some(Command::Open));
        assert_eq!(connection.poll(now_s), None, "asked for once only");
    }

    #[test]
    fn waits_double_up_to_a_limit_and_say_so() {
        let mut connection = Connection::new("ws://there", 0.0);
        let mut now_s = 0.0;
        for wait_s in [0.5, 1.0, 2.0, 4.0, 8.0, 8.0] {
            open(&mut connection, now_s);
            connection.ended(Ended::Closed(String::new()), now_s);
            assert_eq!(connection.poll(now_s + wait_s - 0.01), None, "too early");
            let status = connection.status(now_s).expect("trouble is told");
            assert_eq!(status, format!("cannot reach ws://there, retrying in {} s", wait_s.ceil()));
            now_s += wait_s;
        }
        open(&mut connection, now_s);
    }

    #[test]
    fn why_a_server_cannot_be_reached_is_told() {
        let mut connection = Connection::new("wss://there", 0.0);
        open(&mut connection, 0.0);
        connection.ended(Ended::Closed("its certificate is not trusted".to_owned()), 0.0);
        let status = connection.status(0.0).expect("trouble is told");
        assert_eq!(status, "cannot reach wss://there: its certificate is not trusted, retrying in 1 s");
    }

    #[test]
    fn a_session_that_worked_starts_the_waits_anew() {
        let mut connection = Connection::new("ws://there", 0.0);
        for _ in 0..4 {
            let State::Waiting { until_s } = connection.state else { panic!("waiting") };
            open(&mut connection, until_s);
            connection.ended(Ended::Unreachable(String::new()), until_s);
        }
        let State::Waiting { until_s } = connection.state else { panic!("waiting") };
        open(&mut connection, until_s);
        connection.opened(until_s);
        connection.welcomed(until_s);
        assert!(connection.is_working());
        assert_eq!(connection.status(until_s), None);
        connection.ended(Ended::Goodbye("the server shuts down".to_owned()), until_s + 10.0);
        assert_eq!(
            connection.status(until_s + 10.0).as_deref(),
            Some("server closed the connection: the server shuts down, retrying in 1 s")
        );
        assert_eq!(connection.poll(until_s + 10.5), Some(Command::Open));
    }

    #[test]
    fn a_session_that_fails_at_once_does_not_hammer_the_server() {
        let mut connection = Connection::new("ws://there", 0.0);
        let mut opened = 0;
        let mut now_s = 0.0;
        while now_s < 60.0 {
            if connection.poll(now_s) == Some(Command::Open) {
                opened += 1;
                connection.opened(now_s);
                connection.welcomed(now_s);
                connection.ended(Ended::Fault("wrong version".to_owned()), now_s);
            }
            now_s += 0.1;
        }
        assert!((8..=12).contains(&opened), "{opened} tries in a minute");
    }

    #[test]
    fn a_silent_server_is_given_up() {
        let mut connection = Connection::new("ws://there", 0.0);
        open(&mut connection, 0.0);
        connection.opened(1.0);
        assert_eq!(connection.poll(1.0 + WELCOME_WITHIN_S), None);
        assert_eq!(connection.status(5.0).as_deref(), Some("waiting for ws://there to answer"));
        assert_eq!(connection.poll(1.1 + WELCOME_WITHIN_S), Some(Command::Close));
        assert!(connection.status(17.0).expect("trouble").contains("it did not answer"));
        let mut connection = Connection::new("ws://there", 0.0);
        open(&mut connection, 0.0);
        assert_eq!(connection.poll(WELCOME_WITHIN_S + 0.1), Some(Command::Close));
        assert!(connection.status(15.2).expect("trouble").starts_with("cannot reach"));
    }

    #[test]
    fn events_of_a_socket_that_is_gone_change_nothing() {
        let mut connection = Connection::new("ws://there", 0.0);
        connection.opened(0.0);
        connection.welcomed(0.0);
        connection.ended(Ended::Closed("late".to_owned()), 0.0);
        assert!(!connection.is_working());
        open(&mut connection, 0.0);
    }

    #[test]
    fn who_is_refused_does_not_come_again_by_itself() {
        let mut connection = Connection::new("there", 0.0);
        open(&mut connection, 0.0);
        connection.opened(0.0);
        connection.ended(Ended::Refused("the token is wrong".to_owned()), 0.1);
        assert_eq!(connection.poll(1e6), None);
        assert_eq!(connection.status(1e6).as_deref(), Some("there does not let you in: the token is wrong"));
        connection.retry_now(1e6);
        open(&mut connection, 1e6);
    }

    /// When tries begin, of a client that was cut off at 10 s and reaches nobody.
    fn tries_after_a_cut(round_trip_s: f64) -> Vec<f64> {
        let mut connection = Connection::new("there", 0.0);
        open(&mut connection, 0.0);
        connection.opened(0.0);
        connection.welcomed(0.0);
        connection.measured(round_trip_s);
        connection.ended(Ended::Closed(String::new()), 10.0);
        let times_s = (0..6000).map(|step| 10.0 + f64::from(step) * 0.01);
        times_s.filter(|&now_s| connection.poll(now_s) == Some(Command::Open)).collect()
    }

    #[test]
    fn who_was_cut_off_tries_again_within_seconds() {
        let tries_s = tries_after_a_cut(0.1);
        assert!(tries_s[..12].windows(2).all(|pair| pair[1] - pair[0] < 4.6), "{tries_s:?}");
        assert!(tries_s.windows(2).any(|pair| pair[1] - pair[0] > WELCOME_WITHIN_S), "none is patient: {tries_s:?}");
        let slow_s = tries_after_a_cut(1.5);
        assert!(slow_s[1] - slow_s[0] > 9.0, "a handshake takes 4.5 s here: {slow_s:?}");
    }

    #[test]
    fn a_person_may_skip_the_wait() {
        let mut connection = Connection::new("ws://there", 0.0);
        open(&mut connection, 0.0);
        connection.ended(Ended::Unreachable(String::new()), 0.0);
        connection.retry_now(0.1);
        open(&mut connection, 0.1);
    }
}

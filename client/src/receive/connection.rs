//! Keeping a connection: when to open it, when to try again, and what to tell the person meanwhile.
//!
//! A sans-IO state machine. Its driver opens and closes sockets when [`Connection::poll`] says so, and reports what became of
//! them. Waits double from [`FIRST_WAIT_S`] to [`LONGEST_WAIT_S`] and begin anew after a session that worked.

/// The wait before the first new try, in seconds: a restarted server is back in less than that.
pub const FIRST_WAIT_S: f64 = 0.5;
/// The longest wait: a person who watches sees something happen.
pub const LONGEST_WAIT_S: f64 = 8.0;
/// A server that has not said welcome after this is given up, in seconds. A server may still be loading its scene.
pub const WELCOME_WITHIN_S: f64 = 15.0;
/// A session that lasted this long worked: the next wait is the first one again.
const WORKED_AFTER_S: f64 = 5.0;

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
    /// It never came about.
    Unreachable,
    /// The other end closed it, or it broke; what was said about it, possibly nothing.
    Closed(String),
    /// The server gave a reason.
    Goodbye(String),
    /// The other end broke the protocol.
    Fault(String),
}

#[derive(Debug, Clone, PartialEq)]
enum State {
    Waiting { until_s: f64 },
    Opening { since_s: f64 },
    Greeting { since_s: f64 },
    Working { since_s: f64 },
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Connection {
    address: String,
    state: State,
    next_wait_s: f64,
    ended: Option<Ended>,
}

impl Connection {
    /// To be opened at once. The address is what a person is shown.
    pub fn new(address: impl Into<String>, now_s: f64) -> Connection {
        Connection {
            address: address.into(),
            state: State::Waiting { until_s: now_s },
            next_wait_s: FIRST_WAIT_S,
            ended: None,
        }
    }

    /// What to do now.
    pub fn poll(&mut self, now_s: f64) -> Option<Command> {
        match self.state {
            State::Waiting { until_s } if now_s >= until_s => {
                self.state = State::Opening { since_s: now_s };
                Some(Command::Open)
            }
            State::Opening { since_s } if now_s - since_s > WELCOME_WITHIN_S => {
                self.ended(Ended::Unreachable, now_s);
                Some(Command::Close)
            }
            State::Greeting { since_s } if now_s - since_s > WELCOME_WITHIN_S => {
                self.ended(Ended::Fault("it did not answer".to_owned()), now_s);
                Some(Command::Close)
            }
            _ => None,
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
        }
    }

    /// The socket is gone, or must go.
    pub fn ended(&mut self, why: Ended, now_s: f64) {
        match self.state {
            State::Waiting { .. } => return,
            State::Working { since_s } if now_s - since_s >= WORKED_AFTER_S => self.next_wait_s = FIRST_WAIT_S,
            _ => {}
        }
        let why = match (why, &self.state) {
            (Ended::Closed(_), State::Opening { .. }) => Ended::Unreachable,
            (why, _) => why,
        };
        self.ended = Some(why);
        self.state = State::Waiting { until_s: now_s + self.next_wait_s };
        self.next_wait_s = (self.next_wait_s * 2.0).min(LONGEST_WAIT_S);
    }

    /// Tries again at once, because a person asked for it.
    pub fn retry_now(&mut self, now_s: f64) {
        if let State::Waiting { until_s } = &mut self.state {
            *until_s = now_s;
        }
    }

    /// Whether the server has said welcome.
    pub fn is_working(&self) -> bool {
        matches!(self.state, State::Working { .. })
    }

    /// The server's own reason, where that was the last thing to end a session.
    pub fn goodbye(&self) -> Option<&str> {
        match &self.ended {
            Some(Ended::Goodbye(reason)) => Some(reason),
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
                    Some(Ended::Unreachable) => format!("cannot reach {address}"),
                    Some(Ended::Closed(said)) if said.is_empty() => "the connection was lost".to_owned(),
                    Some(Ended::Closed(said)) => format!("the connection was lost: {said}"),
                    Some(Ended::Goodbye(reason)) => format!("server closed the connection: {reason}"),
                    Some(Ended::Fault(fault)) => format!("something is wrong with the server at {address}: {fault}"),
                };
                let wait_s = (until_s - now_s).max(0.0).ceil();
                Some(if wait_s >= 1.0 { format!("{why}, retrying in {wait_s} s") } else { format!("{why}, retrying") })
            }
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
    fn a_session_that_worked_starts_the_waits_anew() {
        let mut connection = Connection::new("ws://there", 0.0);
        for _ in 0..4 {
            let State::Waiting { until_s } = connection.state else { panic!("waiting") };
            open(&mut connection, until_s);
            connection.ended(Ended::Unreachable, until_s);
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
    fn a_person_may_skip_the_wait() {
        let mut connection = Connection::new("ws://there", 0.0);
        open(&mut connection, 0.0);
        connection.ended(Ended::Unreachable, 0.0);
        connection.retry_now(0.1);
        open(&mut connection, 0.1);
    }
}

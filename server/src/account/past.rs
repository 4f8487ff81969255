/// What looks ever did to an account. Accounts of equal pasts that are not [`Past::Own`] differ in nothing but times and rows at rest.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Past {
    /// Nothing.
    #[default]
    None,
    /// What others may have been through, by its number.
    Shared(u64),
    /// What nobody else has.
    Own,
}

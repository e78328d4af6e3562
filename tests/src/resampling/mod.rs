//! Resampling without a renderer: the library's reservoirs and forms of MIS on small tables, against expectations that are
//! computed independently.
//!
//! | module | what |
//! |---|---|
//! | [`table`] | five pixels, twelve lights, committed |
//! | [`forms`] | one combine, by the library and as it was printed wrong |
//! | [`setting`] | confidence, and where visibility counts |
//! | [`expectation`] | what each form estimates, in closed form |
//! | [`trials`] | the forms at work, many times |
//! | [`mod@line`] | samples whose shift has a Jacobian, through reuse in time and space and exchange |
//! | [`shifted`] | measurements of these, and their report |
//! | [`averaging`] | visibility averaged over a chain of merges |
//! | [`toys`] | what the averaging biases and what not |
//! | [`report`] | the figures as a document |

pub mod averaging;
pub mod expectation;
pub mod forms;
pub mod line;
pub mod report;
pub mod setting;
pub mod shifted;
pub mod table;
pub mod toys;
pub mod trials;

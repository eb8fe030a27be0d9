//! The words that annotators of indoor scans use for the 13 classes of S3DIS.

use s3d_label::Class;

/// The classes of the annotators' words. Other words are in none of the 13 classes.
const WORDS: [(Class, &[&str]); 12] = [
    (Class::CEILING, &["ceiling"]),
    (Class::FLOOR, &["floor", "carpet", "rug", "mat", "doormat", "yoga mat"]),
    (
        Class::WALL,
        &["wall", "closet wall", "closet walls", "shower wall", "shower walls", "divider", "room divider"],
    ),
    (Class::BEAM, &["beam"]),
    (Class::COLUMN, &["column", "pillar", "structure column"]),
    (Class::WINDOW, &["window", "windows", "windowframe"]),
    (
        Class::DOOR,
        &[
            "door",
            "doors",
            "doorframe",
            "door frame",
            "closet door",
            "closet doors",
            "sliding door",
            "shower door",
            "closet doorframe",
            "sliding wood door",
            "glass doors",
        ],
    ),
    (
        Class::TABLE,
        &[
            "table",
            "desk",
            "coffee table",
            "end table",
            "dining table",
            "side table",
            "folded table",
            "round table",
            "conference table",
            "foosball table",
            "ping pong table",
            "dinner table",
            "massage table",
            "pool table",
            "folding table",
            "computer desk",
        ],
    ),
    (
        Class::CHAIR,
        &[
            "chair",
            "chairs",
            "office chair",
            "armchair",
            "stool",
            "folded chair",
            "folded chairs",
            "stack of chairs",
            "lounge chair",
            "beach chair",
            "dining chair",
            "folding chair",
            "desk chair",
            "high chair",
            "rocking chair",
            "bar stool",
            "step stool",
            "seat",
            "footstool",
        ],
    ),
    (Class::SOFA, &["sofa", "couch", "loveseat", "futon", "sofa chair", "sofa bed", "beanbag chair"]),
    (
        Class::BOOKCASE,
        &[
            "bookshelf",
            "bookshelves",
            "bookcase",
            "shelf",
            "shelves",
            "book shelf",
            "book rack",
            "storage shelf",
        ],
    ),
    (Class::BOARD, &["whiteboard", "whiteboards", "blackboard", "bulletin board", "board", "poster board"]),
];

/// Returns the class of S3DIS that a word means. Capitals do not matter, and `_` stands for a space.
pub(crate) fn class_of_word(word: &str) -> Option<Class> {
    let word = word.to_lowercase().replace('_', " ");
    WORDS
        .iter()
        .find(|(_, words)| words.contains(&word.trim()))
        .map(|(class, _)| *class)
}

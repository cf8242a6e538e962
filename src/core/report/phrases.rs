//! Words as people read them.

/// With a capital at the start.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_first_letter_of_any_alphabet_is_a_capital() {
        for (text, told) in
            [("pitch rate", "Pitch rate"), ("", ""), ("äther", "Äther"), ("ẋ", "Ẋ"), ("4 ms", "4 ms")]
        {
            assert_eq!(super::capitalised(text), told);
        }
    }
}

"""The scenario file's tables, strictly typed; every key carries the sentence that the manual shows for it."""

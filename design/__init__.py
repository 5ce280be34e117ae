"""Plant model and additive bound -> the chapter 2 and chapter 3 controllers with their anti-windup."""

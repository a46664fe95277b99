"""Until when united spots stay united: until they let go as a whole, or until their two parts would just touch."""

DETACHMENT, OVERLAP = "detachment", "overlap"
UNITED_UNTIL = (DETACHMENT, OVERLAP)

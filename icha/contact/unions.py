"""Until when united spots stay united: until their two parts would just touch, or until they let go as a whole."""

OVERLAP, DETACHMENT = "overlap", "detachment"
UNITED_UNTIL = (OVERLAP, DETACHMENT)

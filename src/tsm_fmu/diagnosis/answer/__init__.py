"""From the supported hypotheses to the answer: verdict, gaps, candidates, sentence, card."""

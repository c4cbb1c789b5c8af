"""People at the pages: signing in and out, and classes whose pupils join by a code."""

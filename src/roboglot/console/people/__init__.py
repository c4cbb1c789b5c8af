"""Who sits at a page: signing in and out, and classes whose pupils join by a code."""

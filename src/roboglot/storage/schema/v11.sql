-- Who ran or wrote a task last, as [access] knows them: it may do what they may. Empty: nobody was asked.
ALTER TABLE program ADD COLUMN owner TEXT NOT NULL DEFAULT '';
